// A client's stream, looked at while it runs.

const EVERY_MS = 50;

/** Names of the streams that are open, by number. */
export async function streams(get) {
  const { streams: open } = await get("/v1/streams");
  return open.map(({ id, transport, age_s: age }) => [String(id), `stream ${id} (${transport.replace("_", " ")}, ${Math.round(age)} s)`]);
}

export class Live {
  /** `seen` gets each answer, `lost` the reason why there are no more. */
  constructor(get, seen, lost) {
    Object.assign(this, { get, seen, lost, id: undefined });
  }

  /** Follows a stream from now on, or none. */
  follow(id) {
    this.id = id;
    if (id) this.look(id);
  }

  async look(id) {
    if (this.id !== id) return;
    try {
      const look = await this.get(`/v1/streams/${id}`);
      if (this.id !== id) return;
      if (look.answer) this.seen(look);
    } catch (error) {
      if (this.id !== id) return;
      this.id = undefined;
      this.lost(error.refused ? `The stream has ended: ${error.message}` : "The server does not answer.");
      return;
    }
    setTimeout(() => this.look(id), EVERY_MS);
  }
}
