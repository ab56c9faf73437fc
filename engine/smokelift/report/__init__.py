"""What is known of a shot and said of a result: findings, their words, the page of `inspect`, forecasts.

``facts`` has the findings of a shot that its table shows, where the parts of its result come from, and doubts about
that; ``sentences`` has the words of all findings. ``inspection`` makes the page, with pictures of what was found in the
clip. ``cost`` forecasts time, memory and disk.
"""
