"""`jaxident diagnose`."""

import dataclasses
import os

import click

from jaxident.cli.advice import advising, warn
from jaxident.cli.record import Recorded, origin, with_provenance
from jaxident.cli.session import above_zero, check_outputs, columns_option, seed_option, table, write_json, wrote
from jaxident.progress import working
from jaxident.start import start_jax

OUTPUTS = ("diagnosis.json", "nominal_model.json", "corrected_model.json", "report.html")
SENTENCE = {
    "no_gap": "no gap: the nominal model predicts these runs as well as their noise allows",
    "parameters": "the model's form is right, its parameters are not",
    "effects": "the nominal model misses {effects}",
    "partly": "the nominal model misses {effects}, and something else that no named effect covers",
    "unknown": "there is a gap that no effect of the catalogue explains",
    "undecided": "undecided: more data are needed",
}


class SeveralPerOption(Recorded):
    """A command whose option --sim takes all words up to the next option, as a shell's pattern gives them."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Repeat the option before each of its words."""
        spread, taking = [], False
        for word, after in zip(args, [*args[1:], "--"][: len(args)], strict=True):
            if word == "--sim":
                taking = True
                if after.startswith("--"):
                    raise click.UsageError("--sim: names no log; the logs of your simulator follow it", ctx)
            elif taking and not word.startswith("--"):
                spread += ["--sim", word]
            else:
                taking = False
                spread.append(word)
        return super().parse_args(ctx, spread)


@click.command("diagnose", cls=SeveralPerOption)
@click.argument("logs", nargs=-1, required=True, metavar="LOG...")
@click.option("--sim", multiple=True, metavar="LOG...", help="Logs of your own simulator, after those of the robot.")
@click.option("--model", metavar="MODEL", help="Judge this model, with its effects and laws, in place of a fitted one.")
@click.option("--horizon", type=above_zero, metavar="S", help="How many seconds ahead errors are judged (default: 1).")
@click.option("--out", default="diagnosis", show_default=True, metavar="DIR", help="The folder to write.")
@columns_option
@seed_option
def command(logs, columns, sim, model, horizon, out, seed):
    """Find the sim-to-real gap: how large it is, which effects cause it, and how far it shrinks with them.

    LOG is a file or a folder. In a folder, files named `sim_*` are logs of your simulator. The same logs and seed give
    the same result.

    Example: jaxident diagnose run_1.csv run_2.csv run_3.csv --out diagnosis
    """
    start_jax()
    from jaxident.diagnosis.diagnose import diagnose
    from jaxident.diagnosis.preparation.prepare import suspected_wheels
    from jaxident.estimation.suspicions.log_suspicions import log_suspicions
    from jaxident.files.atomic import make_folder
    from jaxident.files.diagnosis import diagnosis_to_dict
    from jaxident.files.logs import find_logs, find_simulated, read_log, read_logs
    from jaxident.files.models import load_model, save_model
    from jaxident.log import join
    from jaxident.report.diagnosis import diagnosis_page
    from jaxident.report.page import write_page

    records, simulated = read_logs(logs, columns), find_logs(sim) if sim else find_simulated(logs)
    theirs = [read_log(path) for path in simulated]
    nominal = load_model(model) if model else None
    at_once = (*log_suspicions(join(records)), *suspected_wheels(join(records)))
    warn(at_once, columns)
    warn(f"the simulator's logs: {line}" for line in (log_suspicions(join(theirs)) if theirs else ()))
    make_folder(out)  # what cannot be written is told before the work, not after it
    check_outputs(*(os.path.join(out, name) for name in OUTPUTS))
    with working("diagnosing"), advising(columns):
        found = diagnose(records, sim=theirs or None, model=nominal, horizon=horizon, seed=seed)
    warn(line for line in found.suspicions if line not in at_once)
    made = origin(OUTPUTS[0], logs=find_logs(logs), sim=simulated)
    click.echo("\n".join(_told(found)))
    write_json(with_provenance(diagnosis_to_dict(found), made, OUTPUTS[0]), os.path.join(out, OUTPUTS[0]))
    for name, written in zip(OUTPUTS[1:3], (found.nominal_model, found.corrected_model), strict=True):
        save_model(_with_origin(written, made._replace(output=name)), os.path.join(out, name))
        wrote(os.path.join(out, name))
    page = os.path.join(out, OUTPUTS[3])
    write_page(diagnosis_page(found, _title(logs), made), page)
    wrote(page)


def _with_origin(model, made):
    """The model, saying where it comes from."""
    from jaxident.files.origins import with_origin

    return dataclasses.replace(model, provenance=with_origin(model.provenance, made))


def _title(logs) -> str:
    """The name of the folder, or the names of the logs, without what leads to them."""
    from jaxident.files.logs import find_logs

    named = logs if len(logs) == 1 else find_logs(logs)
    return ", ".join(os.path.basename(os.path.normpath(path)) for path in named)


def _told(found) -> list[str]:
    """What the terminal says of a diagnosis."""
    from jaxident.report.account import account_lines
    from jaxident.report.discovered import sentence
    from jaxident.report.lead import needless, refusal, too_much_noise
    from jaxident.report.motor_or_ground import wheels_line
    from jaxident.report.stretches import left_out
    from jaxident.report.words import plain_text

    lines = [*([told] if (told := left_out(found)) else []), *account_lines(found.account)]
    lines.append(f"verdict: {SENTENCE[found.verdict].format(effects=' and '.join(found.selected))}")
    lines += [f"discovered: {plain_text(sentence(shown))}" for shown in found.discovered]
    lines += [f"refused: {told}"] if (told := refusal(found)) else []
    lines += [f"needless: {told}"] if (told := needless(found)) else []
    lines += [plain_text(told)] if (told := too_much_noise(found)) else []
    lines += [table([("cause", "takes part", "site"), *_causes(found)]), _gap(found)]
    lines += wheels_line(found)
    if found.surplus:
        lines.append(f"your simulator has, and the robot has not: {', '.join(found.surplus)}")
    return [*lines, found.next]


def _causes(found) -> list[tuple[str, ...]]:
    rows = [(c.effect, f"{c.probability:.3f}", c.site) for c in found.judgement.causes]
    return [*rows, ("something that no named effect covers", f"{found.judgement.unexplained:.3f}", "")]


def _gap(found) -> str:
    from jaxident.report.words import error, plain_text

    gap, rms = found.gap, found.gap.rms
    rows: list[tuple[str, ...]] = [("model", "error", "camera variances")]
    given = [("before", "as given", gap.before)] if any(p.nominal is not None for p in found.parameters) else []
    names = [*given, ("refitted", "nominal, parameters refitted" if given else "nominal", gap.refitted)]
    last = [("after", "with named effects" if found.discovered else "corrected", gap.after)]
    if found.discovered:
        last = [*(last if found.selected else []), ("discovered", "with discovered laws", gap.discovered)]
    for key, name, level in (*names, *last, ("floor", "noise alone", gap.floor)):
        rows.append((name, plain_text(error(rms[key])), f"{level:.3g}"))
    lines = f"root mean square error {gap.horizon:.3g} s ahead\n{table(rows)}"
    if gap.shrink.interval is None or gap.whole.interval is None:
        return lines
    told = f"{lines}\nof the error beyond noise the corrected model takes away {_shrink(gap.whole)}"
    return f"{told}; named effects alone {_shrink(gap.shrink)}" if found.discovered and found.selected else told


def _shrink(shrink) -> str:
    """A shrink and its interval, in per cent."""
    low, high = shrink.interval
    return f"{100 * shrink.value:.0f} % ({100 * low:.0f} to {100 * high:.0f} %, 90 % interval)"
