// A flight that is still flown: asks the server that gave the page what is new, until it ends.

import type { FlightData } from "./flight_data";

const PAUSE_MS = 500;

/**
 * @param address where the flight is
 * @param renewed the flight has gone on
 * @param ended no more will come
 */
export async function followLive(
  address: string,
  renewed: (data: FlightData) => void,
  ended: () => void,
): Promise<void> {
  let known = -1;
  for (;;) {
    await new Promise((done) => setTimeout(done, PAUSE_MS));
    try {
      const answer = await fetch(`${address}?known=${known}`, { cache: "no-store" });
      if (answer.status === 200) {
        const { samples, over, flight } = await answer.json();
        known = samples;
        renewed(flight);
        if (over) break;
      } else if (answer.status !== 204) break;
    } catch {
      // the server ended with the flight
      break;
    }
  }
  ended();
}
