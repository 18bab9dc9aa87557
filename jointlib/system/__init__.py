"""What the operating system gives: how much memory may be taken, and the processors that share long work."""
