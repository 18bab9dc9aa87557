"""Effects a joint model may lack, one family to a module; found through the entry points ``jointlib.effects``."""
