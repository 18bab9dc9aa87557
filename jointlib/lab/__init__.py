"""What laboratories write: text tables of any dialect and the files of loggers, to columns of numbers."""
