"""What a laboratory asks of shock response spectra: targets, tolerances, checks of the record
behind one."""
