"""`jaxident effects`."""

import math
import textwrap

import click

from jaxident.cli.session import json_option, write_json

WIDTH = 100


@click.command()
@json_option
def command(json_file):
    """Print the catalogue: what real robots do beyond the nominal model, with equations and parameters.

    "Neutral" is the value at which an effect does nothing. "Range" is what real robots show.

    Example: jaxident effects --json catalogue.json
    """
    from jaxident.effects.catalogue import CATALOGUE, SITES

    for site in SITES:
        click.echo(f"{site}\n{'-' * len(site)}")
        for entry in CATALOGUE.values():
            if entry.site == site:
                click.echo(_described(entry))
        click.echo()
    write_json([_content(entry) for entry in CATALOGUE.values()], json_file)


def _described(entry) -> str:
    lines = [f"{entry.name}{' (extension)' if entry.extension else ''}", f"    {entry.equation}"]
    for parameter in entry.parameters:
        name = f"{parameter.name} [{parameter.unit}]" if parameter.unit else parameter.name
        low, high = parameter.range
        does = "default" if parameter.shape else "neutral"
        lines.append(f"    {name:<26} {does} {parameter.neutral:<5g} range {low:g} to {high:g}")
    if entry.confused_with:
        lines.append(f"    confused with {', '.join(entry.confused_with)}")
    source = textwrap.wrap(entry.source, WIDTH, initial_indent="    ", subsequent_indent="    ")
    return "\n".join([*lines, *source])


def _content(entry) -> dict:
    """The row for programs; an infinite neutral value, which JSON cannot hold, is null."""
    parameters = [
        {
            "name": parameter.name,
            "unit": parameter.unit,
            "neutral": parameter.neutral if math.isfinite(parameter.neutral) else None,
            "range": list(parameter.range),
        }
        for parameter in entry.parameters
    ]
    return {
        "name": entry.name,
        "site": entry.site,
        "equation": entry.equation,
        "parameters": parameters,
        "confused_with": list(entry.confused_with),
        "extension": entry.extension,
        "channels": list(entry.channels),
        "smooth": entry.smooth,
        "grid": None if entry.grid is None else list(entry.grid),
        "source": entry.source,
    }
