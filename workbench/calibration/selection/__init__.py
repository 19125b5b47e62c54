"""Selection of terms of the model and rejection of outliers."""
