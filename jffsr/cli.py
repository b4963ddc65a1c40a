"""The command line: parse, call the study, print."""

from __future__ import annotations

import argparse
import contextlib
import errno
import gc
import os
import sys
import traceback
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from jffsr.errors import InputError

if TYPE_CHECKING:
    from jffsr.study.claiming import Run

MET, DEFECT, BAD_INPUT, NOT_MET, INTERRUPTED = 0, 1, 2, 3, 130
_NO_ROOM = (errno.ENOSPC, errno.EFBIG, getattr(errno, "EDQUOT", None))

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


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command and return its exit status."""
    arguments = _parser().parse_args(argv)
    # Importing and drawing make millions of objects that stay: looking through them again and again for rubbish
    # took a sixth of a short run.
    often = gc.get_threshold()
    gc.set_threshold(100_000, *often[1:])
    try:
        return arguments.command(arguments)
    except InputError as error:
        print(f"jffsr: {error}", file=sys.stderr)
        return BAD_INPUT
    except KeyboardInterrupt:
        print("jffsr: interrupted", file=sys.stderr)
        return INTERRUPTED
    except BrokenPipeError:
        # The reader of our output has gone; what was computed is already in its folder.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return MET
    except OSError as error:
        if error.errno not in _NO_ROOM:
            return _defect()
        print(f"jffsr: {error.strerror}; make room and repeat the command", file=sys.stderr)
        return BAD_INPUT
    except Exception:
        return _defect()
    finally:
        gc.set_threshold(*often)


def _defect() -> int:
    traceback.print_exc()
    print("jffsr: this is a defect in jffsr, please report it with the lines above", file=sys.stderr)
    return DEFECT


def _parser() -> argparse.ArgumentParser:
    from jffsr import __version__

    parser = argparse.ArgumentParser(
        prog="jffsr",
        description=_DESCRIPTION,
        epilog=_EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--version", action="version", version=f"jffsr {__version__}")
    commands = parser.add_subparsers(title="commands", required=True, metavar="COMMAND")

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
    run.set_defaults(command=_run)

    _add_sweep(commands)

    check = commands.add_parser(
        "check",
        help="re-verify a finished run with MuJoCo and MJX",
        description="Drive the robot's joints along the plan by torques alone in MuJoCo and in MJX, and report "
        "the differences in base pose and momentum.",
    )
    check.add_argument("run", metavar="RUN_DIR", help="a finished run folder")
    check.set_defaults(command=_check)

    show = commands.add_parser(
        "show",
        help="print a finished run or sweep and draw its figures",
        description="Print a finished run or sweep and draw it, as .png and, for a paper, as .pdf.",
    )
    show.add_argument("run", metavar="RUN_DIR", help="the folder of a finished run or sweep")
    show.set_defaults(command=_show)

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
    robots.set_defaults(command=_robots)
    return parser


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
    sweep.set_defaults(command=_sweep, coordinator=None, processes=None, process=None)


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
    capability.set_defaults(command=_map, coordinator=None, processes=None, process=None)


def _map(arguments: argparse.Namespace) -> int:
    _prepare_jax()
    _use_all_devices(arguments)
    from jffsr.study.capability import build_map, map_text

    robot, capability, path = build_map(arguments.robot, arguments.out, arguments.settings)
    from jffsr.viz.capability import save_map_figures

    files = save_map_figures(capability, robot, path.with_suffix(""))
    print(map_text(capability, path) + "\n  figures " + "\n          ".join(map(str, files)))
    return MET


def _sweep(arguments: argparse.Namespace) -> int:
    from jffsr.study.sweep.specification import read_sweep

    spec = read_sweep(arguments.config, arguments.overrides)
    _prepare_jax()
    _use_all_devices(arguments)
    from jffsr.study.sweep.running import run_sweep

    given = {name: getattr(arguments, name, None) for name in ("together", "workers", "scheduler")}
    sweep = run_sweep(spec, arguments.out, say=print, **given)
    path = sweep.folder.path
    if sweep.interrupted:
        print(
            f"interrupted; what is finished is in '{path}', and the same command with --out {path} goes on from it",
            file=sys.stderr,
        )
        return INTERRUPTED
    if sweep.already_finished:
        print(f"{path} is finished:")
    elif sweep.figures:
        from jffsr.viz.sweep import draw_sweep

        draw_sweep(path, ["png"])
    print(f"\n{sweep.table}\n{spec.name}: {sweep.summary['result']['sentence']}\n  folder  {path}")
    if sweep.failures:
        print(f"jffsr: {sweep.failures[0]}; the same command tries again", file=sys.stderr)
        return DEFECT
    return MET if sweep.summary["result"]["code"] == 0 else NOT_MET


def _run(arguments: argparse.Namespace) -> int:
    from jffsr.study.config import load_config
    from jffsr.study.sweep.specification import is_sweep

    if is_sweep(arguments.config):
        return _sweep(arguments)
    config = load_config(arguments.config, arguments.overrides)
    _prepare_jax(config.precision)
    first = _use_all_devices(arguments)
    from jffsr.study.early import import_early
    from jffsr.study.kinds import run_study, summary_text

    if first:
        import_early(config.output.figures)
    run = run_study(config, arguments.out, say=print if first else lambda text: None)
    if not first:
        return _status(run)
    if run.interrupted:
        path = run.folder.path
        print(
            f"interrupted; '{path}' has the checkpoint, and the same command with --out {path} goes on from it",
            file=sys.stderr,
        )
        return _status(run)
    if run.already_finished:
        print(f"{run.folder.path} is finished:\n")
    elif config.output.figures:
        from jffsr.viz.run import draw_run

        # The fonts of the PDFs take as long as all else that is drawn: those are for `jffsr show`.
        draw_run(run.folder.path, ["png"])
    print(summary_text(run.summary))
    print(f"  folder        {run.folder.path}")
    return _status(run)


def _status(run: Run) -> int:
    if run.interrupted:
        return INTERRUPTED
    return MET if run.summary["result"]["code"] == 0 else NOT_MET


def _use_all_devices(arguments: argparse.Namespace) -> bool:
    """Take all cores, and join the other processes where there are any; whether this one writes and prints."""
    from jffsr.parallel.cores import use_all_cores

    # Called from a program that has used JAX before, the program has chosen.
    with contextlib.suppress(InputError):
        use_all_cores()
    given = {name: getattr(arguments, name) for name in ("coordinator", "processes", "process")}
    if "JAX_COORDINATOR_ADDRESS" not in os.environ and all(value is None for value in given.values()):
        return True
    from jffsr.parallel.processes import is_first, join_processes

    join_processes(**given)
    return is_first()


def _check(arguments: argparse.Namespace) -> int:
    _prepare_jax()
    from jffsr.study.kinds import check_study

    report = check_study(arguments.run)
    print(report.to_text())
    return MET if report.passed else NOT_MET


def _show(arguments: argparse.Namespace) -> int:
    _prepare_jax()
    from jffsr.study.kinds import summary_text
    from jffsr.study.run_folder import RunFolder

    summary = RunFolder(Path(arguments.run)).read_summary()
    if summary.get("kind") == "sweep":
        from jffsr.viz.sweep import draw_sweep

        files = draw_sweep(arguments.run)
        print((Path(arguments.run) / "table.md").read_text(encoding="utf-8"))
        print(f"{summary['name']}: {summary['result']['sentence']}")
    else:
        from jffsr.viz.run import draw_run

        files = draw_run(arguments.run)
        print(summary_text(summary))
    print("  figures       " + "\n                ".join(str(file) for file in files))
    return MET


def _robots(arguments: argparse.Namespace) -> int:
    from jffsr.study.catalogue import catalogue_text, robot_text

    if arguments.robot is None:
        for option in ("out", "posture"):
            if getattr(arguments, option) is not None:
                raise InputError(f"--{option} is for one robot: jffsr robots NAME --{option} ...")
        print(catalogue_text())
        return MET
    text = robot_text(arguments.robot)
    _prepare_jax()
    from jffsr.viz.still import draw_to_file

    path, posture = draw_to_file(arguments.robot, arguments.out, arguments.posture)
    print(f"{text}\ndrawn at {posture} in {path}")
    return MET


def _prepare_jax(precision: str = "float64") -> None:
    """Set what only an entry point may set: the precision, and the folder that keeps compiled programs."""
    import jax

    from jffsr.compiling.keeping import keep_programs

    jax.config.update("jax_enable_x64", precision == "float64")
    keep_programs()


if __name__ == "__main__":
    sys.exit(main())
