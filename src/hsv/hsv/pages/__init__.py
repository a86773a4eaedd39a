"""Pages of a browser: report, campaigns, resilience and the live page."""
