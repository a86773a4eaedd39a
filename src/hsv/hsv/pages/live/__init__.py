"""Live view of a running flight: page, Foxglove server, their data, and the commands of the page."""
