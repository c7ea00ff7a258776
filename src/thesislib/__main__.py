"""The command ``thesis``: list, run, check, accept, certify and site.

Exit status 0: all is well; 1: a run, a check or the site failed; 2: the input was refused.
"""

from __future__ import annotations

import argparse
import os
import signal
import sys
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from thesislib import provenance
from thesislib.companion.chapters import Chapter, InputError, chapter, chapters
from thesislib.companion.parameters import changed_values, parameters, split_assignments

__all__ = ["main"]

FAILED, REFUSED, INTERRUPTED = 1, 2, 130


def main(arguments: Sequence[str] | None = None) -> int:
    """Carry out a command line and return the exit status.

    Parameters
    ----------
    arguments : sequence of str, optional
        The command line without the program's name; `sys.argv` if not given.
    """
    options = _parser().parse_args(arguments)
    command: Callable[[argparse.Namespace], int] = options.command
    signal.signal(signal.SIGTERM, _interrupt)
    try:
        provenance.project_root()
    except FileNotFoundError as error:
        print(f"thesis: {error}", file=sys.stderr)
        return REFUSED
    try:
        return command(options)
    except InputError as error:
        print(f"thesis: {error}", file=sys.stderr)
        return REFUSED
    except KeyboardInterrupt:
        print("thesis: interrupted", file=sys.stderr)
        return INTERRUPTED
    except BrokenPipeError:
        # the reader, `head` say, has what it wanted; nothing may be written to the pipe at exit either
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0


def _interrupt(*_: object) -> None:
    raise KeyboardInterrupt


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="thesis", description="Run, check and build the companion.")
    commands = parser.add_subparsers(required=True, metavar="command")

    command = commands.add_parser("list", help="show the chapters, their parameters and their last runs")
    command.set_defaults(command=_list)

    command = commands.add_parser("run", help="execute chapters whose run is not current")
    command.add_argument(
        "words",
        nargs="*",
        metavar="chapter | name=value",
        help="ids of chapters; with one chapter, parameters to change",
    )
    command.add_argument("--all", action="store_true", help="all chapters, side by side")
    command.add_argument("--again", action="store_true", help="also what is current, and nothing stored")
    command.add_argument(
        "--from-solution", action="store_true", help="take stored solutions; such a run is not published"
    )
    command.set_defaults(command=_run)

    command = commands.add_parser("check", help="compare the runs with the stored values")
    command.add_argument("chapters", nargs="*", metavar="chapter", help="ids of chapters; all without")
    command.set_defaults(command=_check)

    command = commands.add_parser("accept", help="make a chapter's run its stored values")
    command.add_argument("chapter", help="id of the chapter")
    command.add_argument(
        "--tolerance",
        action="append",
        default=[],
        metavar="QUANTITY=ABSOLUTE[:RELATIVE]",
        help="change the tolerance of one quantity",
    )
    command.add_argument(
        "--new-tolerance",
        type=float,
        metavar="RELATIVE",
        help="tolerance of quantities that are not stored yet: this part of their largest magnitude",
    )
    command.add_argument("--reason", help="one sentence, stored with the tolerances that are set")
    command.add_argument(
        "--agreeing",
        action="append",
        default=[],
        metavar="RECORD",
        help="record.json of another run that should agree: sets every tolerance to three times the "
        "largest difference, and at least to --new-tolerance",
    )
    command.set_defaults(command=_accept)

    command = commands.add_parser("certify", help="check a certificate of chapter 7 in exact arithmetic")
    command.add_argument("files", nargs="+", metavar="file", help="certificate, as a run leaves it")
    command.set_defaults(command=_certify)

    command = commands.add_parser("site", help="build the pages of the published runs")
    command.set_defaults(command=_site)
    return parser


def _list(_: argparse.Namespace) -> int:
    from thesislib.companion.listing import listing

    for each in chapters():
        print(*listing(each), sep="\n")
    return 0


def _run(options: argparse.Namespace) -> int:
    names, texts = split_assignments(options.words)
    if options.all == bool(names):
        raise InputError("Say either which chapters to run or --all.")
    wanted = _named(names) or chapters()
    if texts and len(wanted) != 1:
        raise InputError(f"Parameters ({', '.join(texts)}) can be changed for one chapter at a time.")
    for each in wanted:
        parameters(each)
    values = changed_values(wanted[0], texts) if texts else {}

    from thesislib import studies
    from thesislib.companion import runner
    from thesislib.companion.orders import Order
    from thesislib.studies import cluster

    try:
        studies.jobs()
        scheduler = cluster.scheduler_address()
    except (ValueError, studies.ClusterError) as error:
        raise InputError(str(error)) from error
    orders = [Order(each, values, options.from_solution, options.again) for each in wanted]
    due = [each for each in orders if options.again or options.from_solution or each.staleness() is not None]
    for order in orders:
        if order not in due:
            print(f"{order.name}: is current")
    if due and scheduler is not None:
        try:
            cluster.check(scheduler)
        except studies.ClusterError as error:
            raise InputError(str(error)) from error
    reports = runner.run(due, _say)
    for report in reports:
        if report.failure is None:
            print(f"{report.order.name}: {report.seconds:.1f} s, {report.order.folder}")
        else:
            print(
                f"thesis: chapter {report.order.name} failed after {report.seconds:.1f} s: {report.failure} "
                "(its partial notebook and its log are kept in _build/failed)",
                file=sys.stderr,
            )
    return FAILED if any(report.failure is not None for report in reports) else 0


def _say(line: str) -> None:
    """Print a line in one piece, whoever else is printing."""
    sys.stdout.write(f"{line}\n")
    sys.stdout.flush()


def _check(options: argparse.Namespace) -> int:
    wanted = _named(options.chapters) or chapters()

    from thesislib.companion.checks import check

    missed = 0
    for each in wanted:
        found = check(each)
        missed += len(found)
        for miss in found:
            print(f"{each.id} {miss}")
        if not found:
            print(f"{each.id} agrees with its stored values")
    return FAILED if missed else 0


def _accept(options: argparse.Namespace) -> int:
    wanted = chapter(options.chapter)

    from thesislib.companion.acceptance import Wishes, accept

    _, texts = split_assignments(options.tolerance)
    if len(texts) < len(options.tolerance):
        raise InputError("A tolerance is written QUANTITY=ABSOLUTE or QUANTITY=ABSOLUTE:RELATIVE.")
    tolerances = {name: _tolerance(name, text) for name, text in texts.items()}
    wishes = Wishes(
        tolerances, options.new_tolerance, options.reason, [_read(each) for each in options.agreeing]
    )
    accept(wanted, wishes, print)
    return 0


def _read(path: str) -> Mapping[str, Any]:
    from thesislib.companion import documents

    try:
        return documents.read(Path(path))
    except (FileNotFoundError, documents.DocumentError) as error:
        raise InputError(f"{path} is no record of a run: {error}") from error


def _tolerance(name: str, text: str) -> tuple[float, float]:
    absolute, _, relative = text.partition(":")
    try:
        return float(absolute), float(relative or 0.0)
    except ValueError as error:
        raise InputError(f"The tolerance {text!r} of {name} is not ABSOLUTE or ABSOLUTE:RELATIVE.") from error


def _certify(options: argparse.Namespace) -> int:
    from thesislib.stability.checking import CertificateError, check_file

    failed = False
    for name in options.files:
        if not Path(name).is_file():
            raise InputError(f"There is no certificate {name}.")
        try:
            print(f"{name}: {check_file(name)}")
        except CertificateError as error:
            print(f"{name}: {error}")
            failed = True
    return FAILED if failed else 0


def _site(_: argparse.Namespace) -> int:
    from thesislib.companion import site

    try:
        index = site.build()
    except site.SiteError as error:
        print(f"thesis: {error}", file=sys.stderr)
        return FAILED
    print(index)
    return 0


def _named(names: Sequence[str]) -> list[Chapter]:
    """Return the chapters with the ids, each once."""
    return list({each.id: each for each in map(chapter, names)}.values())


if __name__ == "__main__":
    sys.exit(main())
