"""Tests of the adapter without preCICE."""

import unittest

from rockfall import Fault
from rockfall_precice.names import Names, named

TEXT = """<?xml version="1.0"?><precice-configuration>
    <participant name="Other"><provide-mesh name="O"/><read-data name="Force" mesh="O"/></participant>
    <participant name="Rock"><provide-mesh name="R"/><write-data name="Force-End" mesh="R"/>
        <read-data name="Displacement" mesh="R"/></participant>
    <coupling-scheme:serial-explicit><participants first="Rock" second="Other"/><max-time value="0.1"/>
        <time-window-size value="1e-3"/></coupling-scheme:serial-explicit></precice-configuration>"""


def parse(text: str, participant: str = "Rock") -> Names:
    return Names.parse(text, "precice.xml", participant)


class OfNames(unittest.TestCase):
    def test_a_participant_has_its_own_mesh_data_and_scheme(self) -> None:
        names = parse(TEXT)
        self.assertEqual((names.mesh, names.reads, names.writes), ("R", ["Displacement"], ["Force-End"]))
        self.assertEqual(list(named(names.writes, "Force")), [("Force-End", True)])
        self.assertEqual((names.scheme, names.window, names.end_time, names.other), ("serial-explicit", 1e-3, 0.1, "Other"))
        self.assertTrue(names.goes_ahead and not names.is_implicit)
        self.assertFalse(parse(TEXT, "Other").goes_ahead)
        self.assertTrue(parse(TEXT.replace("serial-explicit", "parallel-explicit"), "Other").goes_ahead)
        first = '<time-window-size method="first-participant"/>'
        self.assertEqual(parse(TEXT.replace('<time-window-size value="1e-3"/>', first)).window, 0.0)

    def test_what_is_missing_is_named(self) -> None:
        second = '<participant name="Rock"><provide-mesh name="S"/>'
        for text, participant, said in (
            (TEXT, "Stone", "there are Other, Rock"),
            (TEXT.replace("max-time", "x"), "Rock", "max-time"),
            (TEXT.replace("0.1", "soon"), "Rock", '"soon"'),
            (TEXT.replace('<participant name="Rock">', second), "Rock", "provides 2 meshes"),
            (TEXT.replace('<provide-mesh name="R"/>', ""), "Rock", "provides no mesh"),
            ("<a", "Rock", "not XML"),
        ):
            with self.subTest(said), self.assertRaisesRegex(ValueError, said):
                parse(text, participant)

    def test_a_file_that_is_not_there_is_the_users_fault(self) -> None:
        with self.assertRaisesRegex(Fault, "none.xml: No such file") as raised:
            Names.read("none.xml", "Rock")
        self.assertEqual(raised.exception.kind, "input")


if __name__ == "__main__":
    unittest.main()
