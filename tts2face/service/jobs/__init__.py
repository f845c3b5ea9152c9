"""Jobs of the service: their kinds, their state, webhooks."""
