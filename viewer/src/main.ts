// Reads the flights that the page was written with, shows them, and takes others that are opened.

import type { FlightData } from "./flight_data";
import { followLive } from "./live";
import { Opener } from "./opened";
import { Page } from "./page";

const source = document.getElementById("flights")!;
const live = source.dataset.live;
// a flight that is still flown stands alone
const opener = live ? null : new Opener(put);
const open = opener && (() => opener.ask());
let page = new Page(JSON.parse(source.textContent!), open, live !== undefined);

/** One flight that was opened stands beside the first; two take the place of what is there. */
function put(flights: FlightData[]): void {
  const shown = flights.length > 1 ? flights : [page.data[0], ...flights];
  page.end();
  page = new Page(shown, open);
}

if (live) {
  document.body.classList.add("live");
  const ended = () => document.body.classList.replace("live", "ended");
  void followLive(live, (renewed) => page.renew(renewed), ended);
}
