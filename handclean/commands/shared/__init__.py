"""What several commands share: whose hands, which names, which motions, which skins."""
