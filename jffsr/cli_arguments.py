"""What the command line accepts, and its help."""

from __future__ import annotations

import argparse

_DESCRIPTION = """\
Plan the motion of free-floating space robots: satellites whose arms move while the thrusters are off.

A study is one YAML file. 'jffsr run' searches for a motion, re-runs what it found at a finer step by
independent code, and leaves everything in a run folder; 'jffsr check' then drives the same robot along the
plan in MuJoCo and in MJX."""

_EPILOG = """\
examples:
  jffsr run configs/planning/composite_wu6.yaml
  jffsr run composite_wu6 optimizer.particles=64 task.duration=25 --out runs/faster
  jffsr sweep composite_wu6 task.duration=20,25,30 seeds=20 --out runs/durations
  jffsr run wu_2018
  jffsr run tumbling_box
  jffsr check runs/composite_wu6
  jffsr robots wu_6dof
  jffsr map servicer_7dof

exit status: 0 done and accuracy met; 3 done, accuracy not met; 2 bad input; 130 interrupted, checkpoint
written (the same command with the same --out goes on from there); 1 a defect."""


def parser() -> argparse.ArgumentParser:
    """The parser of all commands; `command` of what it parses is the command's name."""
    from jffsr import __version__

    root = argparse.ArgumentParser(
        prog="jffsr",
        description=_DESCRIPTION,
        epilog=_EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    root.add_argument("--version", action="version", version=f"jffsr {__version__}")
    commands = root.add_subparsers(title="commands", required=True, metavar="COMMAND")

    run = commands.add_parser("run", help="run one study", description="Run one study, whatever its kind.")
    run.add_argument("config", metavar="CONFIG", help="a YAML file, or a name under configs/")
    run.add_argument(
        "overrides", metavar="KEY=VALUE", nargs="*", help="replaces a value, for example task.duration=25"
    )
    run.add_argument(
        "--out",
        metavar="DIR",
        help="the run folder; an existing one of the same configuration is gone on with "
        "(default: the first free of runs/NAME, runs/NAME-2, ...)",
    )
    together = run.add_argument_group(
        "several processes",
        "Start the same command once for each process, on one machine or many; a search is spread over all of them.",
    )
    together.add_argument("--coordinator", metavar="HOST:PORT", help="where the first process listens")
    together.add_argument("--processes", metavar="N", type=int, help="how many there are")
    together.add_argument("--process", metavar="I", type=int, help="which one this is, from 0")
    run.set_defaults(command="run")

    _add_sweep(commands)

    check = commands.add_parser(
        "check",
        help="re-verify a finished run with MuJoCo and MJX",
        description="Drive the robot's joints along the plan by torques alone in MuJoCo and in MJX, and report "
        "the differences in base pose and momentum.",
    )
    check.add_argument("run", metavar="RUN_DIR", help="a finished run folder")
    check.set_defaults(command="check")

    _add_show(commands)
    _add_watch(commands)
    _add_map(commands)

    robots = commands.add_parser(
        "robots",
        help="the catalogue of robots, with sources",
        description="List the catalogue; or print one robot in full and draw it.",
    )
    robots.add_argument("robot", metavar="NAME", nargs="?", help="a catalogue name or a robot file")
    robots.add_argument(
        "--out", metavar="FILE.png", help="where to draw the robot (default: NAME.png in the current folder)"
    )
    robots.add_argument(
        "--posture",
        metavar="Q1,Q2,...",
        help="the joint positions to draw it in, degrees (prismatic: m); write --posture=-30,45 "
        "where the first is negative (default: zero, or unfolded)",
    )
    robots.set_defaults(command="robots")
    return root


def _add_show(commands: argparse._SubParsersAction) -> None:
    show = commands.add_parser(
        "show",
        help="finished runs or sweeps: figures, replay, page, report, video",
        description="Print a finished run or sweep, draw its figures as .png and, for a paper, as .pdf, and on a "
        "terminal open its replay in a browser. Several runs are replayed side by side.",
    )
    show.add_argument("runs", metavar="RUN_DIR", nargs="*", help="the folder of a finished run or sweep")
    file = {"nargs": "?", "const": "", "metavar": "FILE"}
    show.add_argument("--html", help="write the replay as one page (default: RUN_DIR/replay.html)", **file)
    show.add_argument("--report", help="write the report as one page (default: RUN_DIR/report.html)", **file)
    show.add_argument("--video", help="write the replay as a video (default: RUN_DIR/replay.mp4)", **file)
    show.add_argument("--serve", action="store_true", help="open the replay even where there is no terminal")
    show.add_argument("--no-serve", action="store_true", help="do not open the replay")
    show.add_argument(
        "--port", type=int, metavar="N", help="where the replay is served (default: from 8080 on)"
    )
    show.add_argument("--no-browser", action="store_true", help="print where the replay is, and open nothing")
    show.set_defaults(command="show")


def _add_watch(commands: argparse._SubParsersAction) -> None:
    watch = commands.add_parser(
        "watch",
        help="see in a browser how a run or sweep gets on",
        description="Show in a browser how a run or sweep gets on, from its folder alone, until Ctrl-C.",
    )
    watch.add_argument("run", metavar="RUN_DIR", help="the folder of a run or sweep, under way or finished")
    _add_server(watch)
    watch.set_defaults(command="watch")


def _add_server(command: argparse.ArgumentParser) -> None:
    command.add_argument(
        "--port", type=int, metavar="N", help="where the page is served (default: from 8080 on)"
    )
    command.add_argument(
        "--no-browser", action="store_true", help="print where the page is, and open nothing"
    )


def _add_sweep(commands: argparse._SubParsersAction) -> None:
    sweep = commands.add_parser(
        "sweep",
        help="run many studies that differ in a few keys",
        description="Run every combination of the given values, together where they share their shapes; what was "
        "finished before a kill is kept, and the same command with the same --out goes on.",
    )
    sweep.add_argument(
        "config", metavar="CONFIG", help="a sweep's YAML file, or a planning configuration to sweep over"
    )
    sweep.add_argument(
        "overrides",
        metavar="KEY=V1,V2",
        nargs="*",
        help="the values of a key, for example task.duration=20,30; seeds=20 is twenty seeds",
    )
    sweep.add_argument(
        "--out", metavar="DIR", help="the sweep's folder (default: the first free of runs/NAME, ...)"
    )
    sweep.add_argument(
        "--together", metavar="N", type=int, help="points in one compiled call, at most (default: 64)"
    )
    sweep.add_argument(
        "--workers",
        metavar="N",
        type=int,
        help="processes for what shares no shapes (default: cores, at most 4)",
    )
    sweep.add_argument(
        "--scheduler",
        metavar="ADDRESS",
        help="of a dask cluster that does the work, for example tcp://10.0.0.1:8786",
    )
    sweep.set_defaults(command="sweep", coordinator=None, processes=None, process=None)


def _add_map(commands: argparse._SubParsersAction) -> None:
    capability = commands.add_parser(
        "map",
        help="search which poses an arm reaches, cell by cell",
        description="Search a robot's capability map: the share of poses that its tool reaches in each cell of the "
        "workspace, within joint limits and clear of its own bodies. Interrupted, the same command goes on.",
    )
    capability.add_argument("robot", metavar="ROBOT", help="a catalogue name or a robot file")
    capability.add_argument(
        "settings",
        metavar="KEY=VALUE",
        nargs="*",
        help="cells=20000, directions=50, rolls=8, end_effector, self_clearance=true, margin=0.0 (m), seed=0",
    )
    capability.add_argument("--out", metavar="FILE.nc", help="the map's file (default: ROBOT_map.nc)")
    capability.set_defaults(command="map", coordinator=None, processes=None, process=None)
