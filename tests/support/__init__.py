"""What tests share, by what it is; imported as `support.records.campaigns`."""
