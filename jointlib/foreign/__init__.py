"""Files that others wrote: the one door by which their bytes come in, and readers that no damage can bring down."""
