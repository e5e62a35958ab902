"""What is true of any record, whoever made it."""
