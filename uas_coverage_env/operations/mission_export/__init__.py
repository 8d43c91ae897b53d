"""From a flight to files for autopilots and maps, and a report of what flying them takes."""
