"""Errors on the command line of a node end it with a one-line message and exit code 2."""

import sys
from pathlib import Path

import pytest
from marking import long
from waiting import wait_until

pytestmark = pytest.mark.graph

FILES = {
    "full.yaml": "/veh1/tube_mpc:\n  ros__parameters:\n    feedback:\n      tua: [0.8]\n",
    "broken.yaml": "/**:\n  ros__parameters:\n   - x\n",
}

PLANT, TUBE_MPC = ("hsv_plant", "plant"), ("hsv_ctrl", "tube_mpc")
RECORDER = ("hsv_bringup", "recorder")


def test_an_unknown_parameter_for_all_nodes_is_ignored_with_one_warning(processes):
    parameters, output = processes.folder / "all.yaml", processes.folder / "output"
    parameters.write_text("/**:\n  ros__parameters:\n    use_sim: true\n    feedback.tua: [0.8]\n")
    words = ("ros2", "run", *TUBE_MPC, "--ros-args", "--params-file", parameters)
    tube = processes.start(*words, output=output.open("w"))
    wait_until(lambda: tube.poll() is not None or "waiting for" in output.read_text(), [tube.pid])
    [line] = [line for line in output.read_text().splitlines() if "ignored" in line]
    assert "parameter use_sim: tube_mpc has none" in line and "parameter feedback.tua:" in line


def test_a_clock_that_ros_stamps_cannot_hold_is_named(shared_processes):
    program = "import sys, time; time.time = lambda: 2.0**31; from hsv_ctrl.tube_mpc import main; sys.exit(main())"
    done = shared_processes.run(sys.executable, "-c", program)
    assert done.returncode == 2 and ": expected a date before 2038-01-19" in done.stdout, done.stdout


@pytest.mark.parametrize(
    ("node", "arguments", "words"),
    [
        (PLANT, "-p duration:=200", ["duration = 200", "expected double", "(write 200.0)"]),
        long(PLANT, "-p nosuch:=1", ["parameter nosuch", "plant has none", "nearest is"]),
        long(PLANT, "-p bag.directory:=here", ["parameter bag.directory", "recorder has"]),
        long(TUBE_MPC, "-r __ns:=/veh1 --params-file full.yaml", ["feedback.tua", "nearest is feedback.tau"]),
        long(TUBE_MPC, "--params-file broken.yaml", ["broken.yaml"]),
        long(TUBE_MPC, "-p feedback.gain:=[1.0,2.0]", ["feedback.gain", "2 values, expected 18"]),
        long(RECORDER, "-p bag.attachments:=[1]", ["bag.attachments = [1]", "expected string array"]),
        long(RECORDER, "-p bag.attachments:=[nowhere.txt]", ["bag.attachments = 'nowhere.txt'"]),
        long(PLANT, "-p initial.altitude:=30000.0", ["initial.altitude = 30000.0", "25908 to 26365.2 m"]),
        long(PLANT, "-p controller:=nosuch", ["controller = 'nosuch'", "expected one of robust_mpc, tube_mpc"]),
        long(PLANT, "-p vehicle.name:=nosuch", ["vehicle 'nosuch'", "expected one of parker, "]),
        long(PLANT, "-r hsv/state", ["'-r hsv/state'"]),
        long(PLANT, "--nosuch", ["unknown ROS arguments", "--nosuch"]),
        long(PLANT, "-- duration=10", ["argument 'duration=10'"]),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_a_wrong_argument_is_one_line(shared_processes, node, arguments, words):
    for name, text in FILES.items():
        Path(shared_processes.folder, name).write_text(text)
    done = shared_processes.run("ros2", "run", *node, "--ros-args", *arguments.split())
    said = [line for line in done.stdout.splitlines() if not line.startswith("[ros2run]")]
    assert done.returncode == 2 and len(said) == 1, done.stdout
    assert said[0].startswith(f"{node[1]}: error: ")
    for word in words:
        assert word in said[0]
