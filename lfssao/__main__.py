"""``python -m lfssao``."""

import sys

from lfssao.cli.main import main

sys.exit(main())
