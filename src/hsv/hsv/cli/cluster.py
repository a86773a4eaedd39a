"""The command ``hsv cluster``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from hsv.cli.output import console


def cluster(
    hosts: Annotated[
        list[str] | None,
        typer.Argument(help="Hosts as ssh knows them; NAME*8 for 8 workers instead of one a processor."),
    ] = None,
    hosts_file: Annotated[
        Path | None, typer.Option("--hosts", help="File with a host a line; what follows a # is a comment.")
    ] = None,
    address: Annotated[
        str, typer.Option(help="Address at which the hosts reach this machine; default: that of the way to the first.")
    ] = "",
    port: Annotated[int, typer.Option(help="Port of the scheduler.", min=1, max=65535)] = 8786,
    python: Annotated[
        str,
        typer.Option(help="What runs Python with this project on the hosts; default: the same paths as here."),
    ] = "",
    ssh: Annotated[str, typer.Option(help="The command ssh, with options: 'ssh -i key -p 2222'.")] = "ssh",
) -> None:
    """Start workers for campaigns on other hosts over SSH, and the scheduler here; Ctrl-C ends them.

    The hosts need this project in the same version, and must be reached without a password. Workers of a host that was
    cut off are started again; batches that they had are flown by others in the meantime.

    Example: hsv cluster worker-1 me@worker-2*8
    """
    from hsv.base.errors import CampaignError
    from hsv.flight.campaign.cluster import address_for, read_host, read_hosts, remote_python
    from hsv.flight.campaign.cluster import cluster as running

    found = [*map(read_host, hosts or ()), *(read_hosts(hosts_file) if hosts_file else ())]
    if not found:
        raise CampaignError("hosts: none, expected names, or --hosts FILE with some")
    here = address or address_for(found[0].name)

    def say(words: str) -> None:
        console.print(words, soft_wrap=True, markup=False, highlight=False)

    with running(found, here, port, python or remote_python(), ssh, say) as look:
        say(f"scheduler tcp://{here}:{port}, workers on {', '.join(host.name for host in found)}")
        say(f"in another terminal: hsv montecarlo case1 --samples 100000 --scheduler tcp://{here}:{port}")
        while True:
            look()
