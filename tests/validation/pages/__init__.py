"""Pages and figures from the records of the validation: the page of all cases, and the made parts of others."""
