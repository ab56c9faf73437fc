"""What is known of a shot, in words: sentences of remarks and estimates, facts, the page of `inspect`, forecasts."""
