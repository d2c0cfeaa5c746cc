"""python -m organphys_bench"""

from .command_line import main

main()
