"""What to measure on a machine: which forces and places tell apart what its joints may lack, tried on simulation."""
