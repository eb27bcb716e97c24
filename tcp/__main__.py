"""``python -m tcp`` is the ``tcp`` command."""

from tcp.cli.main import main

main()
