"""From logs of vehicles that flew to a flight directory, judged by the rules of the world."""
