"""How a kind of campaign goes at the bench: what is mounted, what is done for each row of a plan,
what is recorded."""
