"""What is known of a shot and said of a result: findings, their words, the page of `inspect`, forecasts."""
