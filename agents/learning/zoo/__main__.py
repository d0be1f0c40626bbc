"""Print the path of an algorithm's hyperparameters: ``python -m agents.learning.zoo``."""

import sys

from agents.learning.zoo import ALGORITHMS, file_of
from curling_env.errors import InputError

try:
    for algorithm in sys.argv[1:] or ALGORITHMS:
        print(file_of(algorithm))
except InputError as error:
    print(error, file=sys.stderr)
    sys.exit(2)
