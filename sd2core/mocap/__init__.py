"""Body motion driven by recorded skeletons."""
