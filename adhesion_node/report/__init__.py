"""What a recording shows: its series, their picture and their table."""
