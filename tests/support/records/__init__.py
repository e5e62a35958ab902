"""What tests make up or play: benches, recordings, pulses, shots, campaigns, verdicts."""
