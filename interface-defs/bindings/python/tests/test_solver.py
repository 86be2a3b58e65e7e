"""Solvers in Python in whole runs: what they are given, and how what is wrong with them ends."""

import os
import signal
import subprocess
import sys
import tempfile
import textwrap
import time
import unittest
from pathlib import Path

import rockfall
from rockfall.runs import program

SCENE = """
end_time = {end_time}
gravity = [0.0, 0.0, -9.81]

[[rock]]
name = "rock"
position = [0.0, 0.0, 0.21]
velocity = [0.0, 0.0, -1.0]
mass = 20.0
shape = {{ type = "sphere", radius = 0.2 }}

[[contact]]
law = "hertz_mindlin"
young = 1e7
poisson = 0.25
restitution = 0.5

[processes]
fem = "./solver.py"

[coupling]
scheme = "{scheme}"
time_window = 1e-3

[custom]
stiffness = 2e4
"""

SOLVER = """
#!{python}
import numpy as np
import rockfall

class Mass(rockfall.Structure):
    largest_window = 1e-2
    def prepare(self, plan):
        self.stiffness = plan.scene["custom"]["stiffness"]
        mesh = rockfall.Mesh([[0.0, 0.0, 0.0]], masses=[20.0])
        return rockfall.Ready(mesh, state=(0.0, 0.0), gauges=[rockfall.Gauge("mass_uz", "m")])
    def solve(self, state, window, takes, gives, gauges):
        (u, v), h, force = state, window.length, takes[0]
        middle = u + 0.5 * h * v
        v = v + h * (force[0, 0, 2] - self.stiffness * middle) / 20.0
        u = middle + 0.5 * h * v
        gives[0][-1, 0] = 0, 0, u
        gives[1][-1, 0] = 0, 0, v
        gauges[0] = u
        return u, v

{more}

if __name__ == "__main__":
    rockfall.serve(Bad() if "Bad" in globals() else Mass())
"""


class Runs(unittest.TestCase):
    def setUp(self):
        temporary = tempfile.TemporaryDirectory()
        self.addCleanup(temporary.cleanup)
        self.dir = Path(temporary.name)

    def scene(self, more="", end_time=0.02, scheme="weak"):
        script = self.dir / "solver.py"
        text = SOLVER.format(python=sys.executable, more=textwrap.dedent(more))
        script.write_text(text.lstrip())
        script.chmod(0o755)
        scene = self.dir / "scene.toml"
        scene.write_text(SCENE.format(end_time=end_time, scheme=scheme))
        return scene

    def run_(self, more="", **options):
        return rockfall.run(self.scene(more), out=self.dir / "out", **options)

    def failed(self, more, code, *words):
        with self.assertRaises(rockfall.RunFailed) as caught:
            self.run_(more, force=True)
        for word in words:
            self.assertIn(word, str(caught.exception))
        self.assertEqual(caught.exception.code, code, str(caught.exception))

    def test_a_mass_on_a_spring_stops_the_rock(self):
        results = self.run_(sets={"end_time": 0.3, "coupling.scheme": "strong"})
        self.assertEqual(results.status, "done")
        # 20 kg with 1.09 m/s and a weight of 196 N against 2e4 N/m, and 20 kg of the mass itself.
        self.assertLess(results.measures["mass_uz_min"], -0.02)
        self.assertGreater(results.measures["mass_uz_min"], -0.06)
        curves = results.curves
        self.assertAlmostEqual(list(curves["time_s"])[-1], 0.3)
        self.assertEqual(len(curves["time_s"]), len(curves["mass_uz_m"]))
        self.assertLess(min(curves["mass_uz_m"]), -0.02)
        self.assertIn("done", repr(results))

    def test_shapes_and_scene_are_as_documented(self):
        self.run_(
            """
            class Bad(Mass):
                takes = [rockfall.Field("force", "at_ends"), rockfall.Field("force", "means", samples=2)]
                gives = Mass.gives + [rockfall.Field("heat", "once", components=1)]
                def prepare(self, plan):
                    assert plan.end_time == 0.02 and plan.partner is None and plan.scene["rock"][0]["mass"] == 20.0
                    plan.progress("nothing", 0.5)
                    return super().prepare(plan)
                def start(self, state, gives, gauges):
                    assert gives[0].shape == (1, 1, 3) and gives[2] is None and gauges.shape == (1, 3)
                def solve(self, state, window, takes, gives, gauges):
                    assert not takes[1].flags.writeable and takes[1].shape[1:] == (1, 3), takes
                    assert window.end == window.start + window.length and window.steps(1.0) == 1
                    return super().solve(state, window, [takes[1]], gives, gauges)
                def finish(self, state):
                    return {"last_uz": (state[0], "m")}
            """
        )
        self.assertIn("last_uz", rockfall.Results(self.dir / "out").measures)

    def test_an_exception_ends_the_run_with_its_text_and_place(self):
        self.failed(
            """
            class Bad(Mass):
                def solve(self, state, window, *rest):
                    if window.start > 0.005:
                        raise ValueError("no steel left")
                    return super().solve(state, window, *rest)
            """,
            1,
            "ValueError: no steel left",
            "solver.py, line",
        )
        self.assertIn("Traceback", (self.dir / "out/log/fem.log").read_text())

    def test_bad_input_of_the_user_has_exit_code_2(self):
        self.failed(
            """
            class Bad(Mass):
                def prepare(self, plan):
                    raise rockfall.Fault("custom.stiffness is below 0", "input")
            """,
            2,
            "custom.stiffness is below 0",
        )

    def test_what_a_function_raises_that_makes_the_solver_is_told_to_the_run(self):
        self.failed(
            """
            def refuse():
                raise rockfall.Fault("there is no licence", "input")
            def Bad():
                return refuse
            """,
            2,
            "there is no licence",
        )

    def test_a_count_stands_among_those_of_the_run(self):
        self.run_("class Bad(Mass):\n    def finish(self, state): return {'last_uz': (state[0], 'm'), 'springs': 1}")
        summary = rockfall.Results(self.dir / "out").summary
        self.assertIn("last_uz", summary["measures"])
        self.assertIn("springs", str(summary["cost"]))

    def host(self, more=""):
        host = rockfall.Host([self.dir / "solver.py"], "fem", self.scene(more), self.dir / "hosted", timeout=30.0)
        self.addCleanup(host.close)
        return host

    def test_a_solver_is_asked_window_by_window(self):
        host = self.host(
            """
            class Bad(Mass):
                repeats = 1e-12
                def prepare(self, plan):
                    ready = super().prepare(plan)
                    ready.mesh.groups = {"middle": [0]}
                    return ready
                def finish(self, state):
                    return {"last_uz": (state[0], "m")}
            """
        )
        self.assertEqual((host.program, host.repeats), ("Bad", 1e-12))
        self.assertEqual(host.can_take, [rockfall.Field("force", "means")])
        mesh = host.prepare(1.0, 1e-2, host.can_take, host.can_give)
        self.assertEqual((mesh.coordinates.tolist(), mesh.masses.tolist(), mesh.groups), ([[0.0, 0.0, 0.0]], [20.0], {"middle": [0]}))
        self.assertEqual([(gauge.name, gauge.unit) for gauge in host.gauges], [("mass_uz", "m")])
        first = rockfall.Window(1, 1, 0.0, 1e-2)
        travels = []
        for force in (100.0, 200.0, 100.0):
            host.takes[0][0, 0, 2] = force
            host.solve(first)
            travels.append(float(host.gives[0][-1, 0, 2]))
        # F h2 / (2 m), of the committed state each time.
        self.assertAlmostEqual(travels[0], 100.0 * 1e-4 / 40.0)
        self.assertEqual((travels[1], travels[2]), (2.0 * travels[0], travels[0]))
        host.solve(rockfall.Window(2, 1, 1e-2, 1e-2), commit=True)
        self.assertGreater(host.gives[0][-1, 0, 2], 2.0 * travels[0])
        self.assertEqual(host.gauge_values[0, 0], host.gives[0][-1, 0, 2])
        measures, seconds = host.finish(commit=True)
        self.assertEqual(measures["last_uz"][:2], (host.gives[0][-1, 0, 2], "m"))
        self.assertGreater(seconds, 0.0)
        with self.assertRaisesRegex(rockfall.Fault, "has ended"):
            host.solve(first)

    def test_what_is_wrong_with_a_hosted_solver_is_a_fault(self):
        with self.assertRaisesRegex(rockfall.Fault, "no-such-solver") as raised:
            rockfall.Host(["./no-such-solver"], "fem", self.scene(), self.dir / "hosted")
        self.assertEqual(raised.exception.kind, "input")
        host = self.host("class Bad(Mass):\n    def solve(self, *rest): raise ValueError('no steel left')")
        host.prepare(1.0, 1e-2, host.can_take, host.can_give)
        with self.assertRaisesRegex(rockfall.Fault, "no steel left"):
            host.solve(rockfall.Window(1, 1, 0.0, 1e-2))
        host.close()
        dies = self.host("class Bad(Mass):\n    def solve(self, *rest): __import__('os')._exit(3)")
        dies.prepare(1.0, 1e-2, dies.can_take, dies.can_give)
        with self.assertRaisesRegex(rockfall.Fault, "lost"):
            dies.solve(rockfall.Window(1, 1, 0.0, 1e-2))

    def test_what_is_declared_or_returned_wrongly_is_named(self):
        self.failed("class Bad(Mass):\n    takes = [rockfall.Field('force', 'sometimes')]", 1, "sampling", "sometimes")
        self.failed("class Bad(Mass):\n    def prepare(self, plan): return 3", 1, "rockfall.Ready")
        self.failed("class Bad(Mass):\n    def prepare(self, plan): return rockfall.Ready()", 1, "has a mesh")

    def test_an_array_that_is_kept_is_found_and_a_circle_is_not_taken_for_one(self):
        self.failed(
            """
            class Bad(Mass):
                def solve(self, state, window, takes, *rest):
                    self.kept = takes[0]
                    return super().solve(state, window, takes, *rest)
            """,
            1,
            "the solver has kept an array of the exchange",
        )
        circle = """
            class Bad(Mass):
                def solve(self, state, window, takes, *rest):
                    circle = [takes[0]]
                    circle.append(circle)
                    return super().solve(state, window, takes, *rest)
            """
        self.assertEqual(self.run_(circle, force=True).status, "done")

    def test_a_window_that_fails_is_halved(self):
        results = self.run_(
            """
            class Bad(Mass):
                def solve(self, state, window, *rest):
                    if window.length > 6e-4:
                        raise rockfall.Fault("too long", "window")
                    return super().solve(state, window, *rest)
            """,
            sets={"coupling.scheme": "strong"},
        )
        self.assertGreater(results.summary["coupling"]["windows_halved"], 0)

    def test_a_killed_run_goes_on_to_the_same_bytes(self):
        slow = """
            import pathlib, time
            class Bad(Mass):
                first = None
                def solve(self, state, window, *rest):
                    time.sleep(1e-3)
                    if self.first is None:
                        self.first = window.start
                        pathlib.Path(__file__).with_name("first").write_text(str(window.start))
                    return super().solve(state, window, *rest)
            """
        scene = self.scene(slow, end_time=1.0)
        whole = rockfall.run(scene, out=self.dir / "whole")
        out = self.dir / "parts"
        command = [program(), "run", str(scene), "--out", str(out), "--set", "output.checkpoint=0.1", "--quiet"]
        run = subprocess.Popen(command, stderr=subprocess.DEVNULL)
        until = time.monotonic() + 60.0
        while not list((out / "checkpoint").glob("2.state")):
            self.assertIsNone(run.poll(), "it ended before it was killed")
            self.assertLess(time.monotonic(), until, "no checkpoint")
            time.sleep(0.01)
        run.send_signal(signal.SIGKILL)
        run.wait()
        results = rockfall.run(scene, out=out, options=["--resume"], sets={"output.checkpoint": 0.1})
        self.assertEqual(*((of.path / "history.csv").read_bytes() for of in (whole, results)))
        self.assertGreater(float((self.dir / "first").read_text()), 0.0, "it began anew")

    def test_alone_it_says_how_it_is_started(self):
        self.scene()
        ended = subprocess.run([self.dir / "solver.py"], capture_output=True, text=True)
        self.assertEqual(ended.returncode, 2)
        self.assertIn("rockfall run SCENE", ended.stderr)


    def test_the_solver_of_the_readme_runs(self):
        readme = Path(__file__).resolve().parents[1] / "README.md"
        code = readme.read_text().split("```python\n")[1].split("```")[0]
        scene = self.scene()
        (self.dir / "solver.py").write_text(f"#!{sys.executable}\n{code}")
        results = rockfall.run(scene, out=self.dir / "out")
        self.assertLess(results.measures["mass_uz_min"], 0.0)


class Programs(unittest.TestCase):
    def test_bad_input_is_the_message_of_the_program(self):
        with tempfile.TemporaryDirectory() as temporary:
            scene = Path(temporary) / "scene.toml"
            scene.write_text("end_time = -1.0\n")
            with self.assertRaises(rockfall.RunFailed) as caught:
                rockfall.run(scene, out=Path(temporary) / "out")
        self.assertEqual(caught.exception.code, 2)
        self.assertIn("scene.toml", str(caught.exception))

    def test_fields_are_read_where_meshio_is_there(self):
        try:
            import meshio  # noqa: F401
        except ImportError:
            self.skipTest("meshio is not installed")
        scene = Path(__file__).resolve().parents[4] / "launch/scenes/sphere-on-cable.toml"
        with tempfile.TemporaryDirectory() as temporary:
            sets = {"end_time": 0.01, "output.fields": 0.005}
            results = rockfall.run(scene, sets=sets, out=Path(temporary) / "out")
            times, meshes = zip(*results.fields("structure"))
            with self.assertRaisesRegex(FileNotFoundError, "there are .*structure"):
                results.fields("moon")
        self.assertEqual((times[0], len(meshes[0].points)), (0.0, 3))

    def test_values_of_a_scene_are_written_as_toml(self):
        from rockfall.runs import _toml

        for value, text in ((True, "true"), ("a\"b", '"a\\"b"'), ([1, 2.5], "[1, 2.5]"), ({"a": 1e-5}, '{"a" = 1e-05}')):
            self.assertEqual(_toml(value), text)

    def test_a_program_that_is_not_there_is_said_with_the_cure(self):
        before = os.environ.get("ROCKFALL_BIN")
        os.environ["ROCKFALL_BIN"] = "/no/such/folder"
        try:
            with self.assertRaisesRegex(FileNotFoundError, "ROCKFALL_BIN"):
                rockfall.run("scene.toml")
        finally:
            os.environ.pop("ROCKFALL_BIN")
            if before is not None:
                os.environ["ROCKFALL_BIN"] = before


if __name__ == "__main__":
    unittest.main()
