"""Planning campaigns: factors and their feasible combinations, designs, the order of runs, the
bench's limits."""
