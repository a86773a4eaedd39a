"""Commands another point in flight: ``ros2 run hsv_bringup set_command 26100 2450 --blend 4``."""

from __future__ import annotations

import argparse
from collections.abc import Sequence

from hsv_msgs.srv import SetCommand

from hsv.bags.description import NOMINAL_TRAJECTORY
from hsv.base.errors import ParameterError
from hsv_bringup.client import GraphClient, OneLineParser, acting_from, answer, run_client


def _command(client: GraphClient, options: argparse.Namespace) -> None:
    run = client.find_run()
    fields = {name: getattr(options, name) for name in ("altitude", "velocity", "duration", "blend")}
    response = client.call(NOMINAL_TRAJECTORY, SetCommand, SetCommand.Request(**fields))
    if not response.success:
        raise ParameterError(response.message)
    time, values = acting_from(run, response.step)
    answer(
        f"{response.message}, {time}",
        {"message": response.message, **values, "end_s": round(response.end, 9)},
        options.json,
    )


def main(args: Sequence[str] | None = None) -> int:
    """Run the command."""
    parser = OneLineParser(prog="set_command", description="Command another point of altitude and velocity in flight.")
    parser.add_argument("altitude", type=float, help="m")
    parser.add_argument("velocity", type=float, help="m/s")
    parser.add_argument("--duration", type=float, default=0.0, help="least length of the ramp, s; 0: as short as fits")
    parser.add_argument(
        "--blend", type=float, default=0.0, help="half the time in which the rate changes at a corner, s; 0: 2 s"
    )
    parser.add_argument("--json", action="store_true", help="print a JSON object")
    return run_client(parser, _command, args)
