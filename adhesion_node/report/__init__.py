"""What a recording shows: its series, and the page, the pictures and the table of them."""
