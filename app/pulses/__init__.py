"""Impacts, records and pulses as they are drawn and exported."""
