"""``python -m lfssao``."""

import sys

from lfssao.cli import main

sys.exit(main())
