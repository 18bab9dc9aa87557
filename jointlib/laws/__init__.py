"""The built-in joint laws, one to a module; they are found through the entry points ``jointlib.laws``."""
