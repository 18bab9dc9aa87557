"""The command line: the one place that sees joints, machines and FMUs together, and it imports them lazily."""
