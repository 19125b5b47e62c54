"""Which terms of the model and which observations a fit keeps."""
