"""The schema of scenario files: what each table may contain."""
