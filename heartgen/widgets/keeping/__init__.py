"""What a visitor's session leaves on the disk: inputs, runs and results, and who works on them."""
