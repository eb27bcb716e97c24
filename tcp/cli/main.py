"""The ``tcp`` command: one group, one file per subcommand."""

from __future__ import annotations

import click

import tcp


@click.group(context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(tcp.__version__, prog_name="tcp")
def main() -> None:
    """Drill routes that come with a proof."""
