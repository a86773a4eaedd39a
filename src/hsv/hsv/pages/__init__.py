"""The pages: reports of flights and campaigns, the live page, static plots, layouts for viewers."""
