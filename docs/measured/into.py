"""Puts tables that a command prints into the page that has them: COMMAND | python docs/measured/into.py PAGE

A table of the input takes the place of the table of PAGE with the same head row; the date and the commit at the head of the page are
those of today. What the page lacks is named, and nothing is written.
"""

import datetime
import re
import subprocess
import sys


def tables(text):
    """Tables by their head row, spaces aside."""
    found = {}
    for table in re.findall(r"(?m)(?:^\|.*\n)+", text):
        found["".join(table.split("\n", 1)[0].split())] = table
    return found


def main():
    path, text = sys.argv[1], sys.stdin.read() + "\n"
    with open(path) as file:
        page = file.read()
    new, old = tables(text), tables(page)
    lacking = [head for head in new if head not in old]
    if lacking or not new:
        sys.exit(f"{path} has no table that begins {', '.join(lacking) or '(no table was read)'}")
    for head, table in new.items():
        page = page.replace(old[head], table)
    commit = subprocess.run(["git", "rev-parse", "--short=8", "HEAD"], capture_output=True, text=True).stdout.strip()
    page = re.sub(r"\d{4}-\d\d-\d\d, [0-9a-f]{7,8}", f"{datetime.date.today()}, {commit}", page, count=1)
    with open(path, "w") as file:
        file.write(page)


if __name__ == "__main__":
    main()
