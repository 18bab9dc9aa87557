"""Poles, shapes and residual terms of measured frequency responses, with their standard errors."""
