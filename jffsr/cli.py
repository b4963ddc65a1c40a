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

from jffsr.cli_arguments import parser
from jffsr.errors import InputError

if TYPE_CHECKING:
    from jffsr.study.claiming import Run

MET, DEFECT, BAD_INPUT, NOT_MET, INTERRUPTED = 0, 1, 2, 3, 130
_NO_ROOM = (errno.ENOSPC, errno.EFBIG, getattr(errno, "EDQUOT", None))


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command and return its exit status."""
    arguments = parser().parse_args(argv)
    # Importing and drawing make millions of objects that stay: looking through them again and again for rubbish
    # took a sixth of a short run.
    often = gc.get_threshold()
    gc.set_threshold(100_000, *often[1:])
    try:
        return _COMMANDS[arguments.command](arguments)
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


def _watch(arguments: argparse.Namespace) -> int:
    from jffsr.viz.live.watching import serve_live

    serve_live(arguments.run, arguments.port, open_browser=not arguments.no_browser)
    return MET


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
    from jffsr.study.sweep.ended import outcome_lines
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
    print("\n".join(["", sweep.table, *outcome_lines(sweep.summary), f"  folder  {path}"]))
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
    from jffsr.viz import showing

    for option in ("html", "report", "video"):
        # `jffsr show --html RUN_DIR` means the run, not a file of that name.
        if (name := getattr(arguments, option)) and Path(name).is_dir():
            arguments.runs.insert(0, name)
            setattr(arguments, option, "")
    folders = [Path(run) for run in arguments.runs]
    if not folders:
        raise InputError("jffsr show: the folder of a finished run or sweep is missing")
    if arguments.report and len(folders) > 1:
        raise InputError(
            f"--report {arguments.report}: each of several runs has a report of its own, in its folder"
        )
    figures = {folder: _print_one(folder) for folder in folders}
    written = False
    for option, write in (("html", showing.write_page), ("video", showing.write_video)):
        if (name := getattr(arguments, option)) is not None:
            together = "_and_".join(["replay", *(folder.resolve().name for folder in folders[1:])])
            default = folders[0] / f"{together}.{'mp4' if option == 'video' else option}"
            print(f"  {option:<12}  {write(folders, Path(name) if name else default)}")
            written = True
    if (name := arguments.report) is not None:
        for folder in folders:
            file = Path(name) if name else folder / "report.html"
            print(f"  report        {showing.write_report(folder, figures[folder], file)}")
        written = True
    terminal = sys.stdin.isatty() and sys.stdout.isatty() and not written and showing.can_serve()
    if arguments.serve or (terminal and not arguments.no_serve):
        showing.serve_replays(folders, arguments.port, not arguments.no_browser)
    elif not written and not arguments.no_serve:
        if showing.can_serve():
            told = "there is no terminal; --serve opens it, --html and --report write pages"
        else:
            told = "viser is not installed: pip install 'jffsr[show]'"
        print(f"  replay        not opened, for {told}")
    return MET


def _print_one(folder: Path) -> list[Path]:
    """Print a finished run or sweep, draw its figures, and return their files."""
    from jffsr.study.kinds import summary_text
    from jffsr.viz import showing

    summary = showing.read_summary(folder)
    files = showing.draw(folder)
    if showing.is_sweep(folder):
        from jffsr.study.sweep.ended import outcome_lines

        print((folder / "table.md").read_text(encoding="utf-8"))
        print("\n".join(outcome_lines(summary)))
        for failure in summary.get("failures", ()):
            print(f"  failed        {failure}")
    else:
        print(summary_text(summary))
    print("  figures       " + "\n                ".join(str(file) for file in files))
    return files


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


_COMMANDS = {
    "run": _run,
    "check": _check,
    "robots": _robots,
    "show": _show,
    "sweep": _sweep,
    "map": _map,
    "watch": _watch,
}

if __name__ == "__main__":
    sys.exit(main())
