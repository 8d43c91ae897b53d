// The flights as a table: comma-separated values.

import type { Flight } from "./flight";

/** The readings of all UAS at every sample. */
export function table(flights: Flight[]): string {
  const head = "flight,t_s,uas,x_m,y_m,z_m,soc,needed_soc,voltage_V,current_A,mode,covered";
  const rows = flights.flatMap((flight, n) =>
    flight.scene.uas.flatMap(({ name }, i) =>
      Array.from({ length: flight.data.last[i] + 1 }, (_, k) => {
        const { data } = flight;
        const at = k * flight.uas + i;
        const numbers = [data.soc, data.needed, data.voltage, data.current].map(({ values, unit }) =>
          plain(values[at] * unit),
        );
        const position = flight.position(k, i).map(plain);
        const mode = flight.mode(k, i);
        const cells = [n + 1, plain(k * data.dt_s), quoted(name), ...position, ...numbers, mode, data.covered[k]];
        return cells.join(",");
      }),
    ),
  );
  return [head, ...rows, ""].join("\n");
}

function plain(value: number): string {
  return String(Number(value.toFixed(4)));
}

function quoted(text: string): string {
  return /[",\n]/.test(text) ? `"${text.replaceAll('"', '""')}"` : text;
}
