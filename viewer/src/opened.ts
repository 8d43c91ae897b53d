// Other flights onto the page: replay pages, or the flight directories that hold them, dropped or chosen.

import { element } from "./dom";
import type { FlightData } from "./flight_data";

const NAME = "replay.html";
const MOST_BYTES = 256 * 2 ** 20;
/** A page shows two flights. */
const MOST_FLIGHTS = 2;
const SAID_MS = 8_000;

export class Opener {
  private readonly said = element("p", { class: "opened", role: "status" });
  private readonly chooser = element("input", { type: "file", accept: ".html", multiple: "" }) as HTMLInputElement;
  private hiding = 0;

  /** @param opened one flight, or two */
  constructor(private readonly opened: (flights: FlightData[]) => void) {
    this.said.hidden = this.chooser.hidden = true;
    document.body.append(this.said, this.chooser);
    this.chooser.addEventListener("change", () => {
      void this.take([...this.chooser.files!]);
      this.chooser.value = "";
    });
    addEventListener("dragover", (event) => {
      event.preventDefault();
      this.say(`Drop one or two flights: ${NAME}, or directories that hold it`);
    });
    addEventListener("dragleave", (event) => {
      if (!event.relatedTarget) this.said.hidden = true;
    });
    addEventListener("drop", (event) => {
      event.preventDefault();
      // what was dropped has to be asked for before the event is over
      void this.dropped([...event.dataTransfer!.items].flatMap((item) => droppedIn(item) ?? []));
    });
  }

  /** Let a person choose files. */
  ask(): void {
    this.chooser.click();
  }

  private async dropped(all: Dropped[]): Promise<void> {
    const files: File[] = [];
    for (const { name, page } of all) {
      const file = await page.catch(() => null);
      if (!file) {
        this.say(`${name} holds no ${NAME}: write it with "uas-coverage replay ${name}"`);
        return;
      }
      files.push(file);
    }
    await this.take(files);
  }

  private async take(files: File[]): Promise<void> {
    const flights: FlightData[] = [];
    for (const file of files) {
      const read = await flightsOf(file);
      if (typeof read === "string") {
        this.say(read);
        return;
      }
      flights.push(...read);
    }
    if (flights.length > MOST_FLIGHTS) {
      this.say(`These are ${flights.length} flights: a page shows one or two`);
      return;
    }
    this.said.hidden = true;
    if (flights.length > 0) this.opened(flights);
  }

  private say(words: string): void {
    this.said.textContent = words;
    this.said.hidden = false;
    clearTimeout(this.hiding);
    this.hiding = setTimeout(() => (this.said.hidden = true), SAID_MS);
  }
}

interface Dropped {
  name: string;
  /** A file itself, or the replay page of a flight directory. */
  page: Promise<File | null>;
}

/** Not every browser has it, and it is the one way into directories for a page that is a file itself. */
interface WithHandle extends DataTransferItem {
  getAsFileSystemHandle?(): Promise<FileSystemDirectoryHandle>;
}

function droppedIn(item: WithHandle): Dropped | null {
  const entry = item.webkitGetAsEntry();
  if (!entry) return null;
  const { name } = entry;
  if (entry.isFile) return { name, page: Promise.resolve(item.getAsFile()) };
  const directory = item.getAsFileSystemHandle?.();
  if (directory) {
    const page = directory.then((within) => within.getFileHandle(NAME)).then((file) => file.getFile());
    return { name, page };
  }
  const page = new Promise<File>((done, failed) => {
    const found = (file: FileSystemEntry) => (file as FileSystemFileEntry).file(done, failed);
    (entry as FileSystemDirectoryEntry).getFile(NAME, {}, found, failed);
  });
  return { name, page };
}

/** The flights of a replay page as data, or what is wrong with it in words. */
async function flightsOf(file: File): Promise<FlightData[] | string> {
  if (file.size > MOST_BYTES) return `${file.name} is larger than ${MOST_BYTES / 2 ** 20} MiB`;
  // nothing in a document that was only parsed is run or fetched
  const page = new DOMParser().parseFromString(await file.text(), "text/html");
  const data = page.getElementById("flights")?.textContent;
  if (!data) return `${file.name} is no replay page`;
  if (viewer(page) !== viewer(document)) {
    return `${file.name} was written by another version: write it again with "uas-coverage replay"`;
  }
  try {
    return JSON.parse(data) as FlightData[];
  } catch {
    return `${file.name} is damaged: write it again with "uas-coverage replay"`;
  }
}

/** The script of a page, which knows the form of its own data and of no other. */
function viewer(page: Document): string {
  return page.querySelector("body > script:not([id])")?.textContent ?? "";
}
