"""From the files of a laboratory to a measurement file in which every guess is told."""
