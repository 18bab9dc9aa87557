"""From hammer hits and shaker records to frequency response functions with their variance."""
