// Two flights of one mission at the same second, in words.

import type { Flight } from "./flight";

/** What a flight is ahead or behind another one at a time. */
export function difference(flight: Flight, other: Flight, time: number): string {
  const energy = flight.energy(time) - other.energy(time);
  const covered = flight.moment(time).covered - other.moment(time).covered;
  const longer = flight.duration - other.duration;
  const parts = [
    `${signed(energy, 2)} Wh`,
    `${signed(covered, 0)} ${Math.abs(covered) === 1 ? "waypoint" : "waypoints"}`,
    longer === 0 ? "as long" : `ends ${Math.abs(longer).toFixed(0)} s ${longer > 0 ? "later" : "earlier"}`,
  ];
  return `beside ${other.data.planner}: ${parts.join(", ")}`;
}

function signed(value: number, digits: number): string {
  const text = Math.abs(value).toFixed(digits);
  return Number(text) === 0 ? `±${text}` : `${value > 0 ? "+" : "−"}${text}`;
}
