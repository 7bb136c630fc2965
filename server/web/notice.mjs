// Short texts of the page's own state: the connection, complaints, and what an answer is flagged with.

/** A complaint stays at least this long, then until frames are answered again. */
const NOTICE_MS = 6000;
const STATES = { connecting: 'connecting', ready: 'connected', waiting: 'disconnected', refused: 'refused' };

export const byId = (id) => document.getElementById(id);

/** Writes a text where it differs from the one that stands there: text is laid out afresh whenever it is written. */
export function put(id, text) {
  if (byId(id).textContent !== text) byId(id).textContent = text;
}

/** Writes what is always read, and what is read where there is room. */
export function putParts(id, [text, more]) {
  const [first, second] = byId(id).children;
  if (first.textContent !== text) first.textContent = text;
  if (second.textContent !== more) second.textContent = more;
}

export function showState(state, detail) {
  const { [state]: word } = STATES;
  byId('state').dataset.state = state;
  byId('state-text').textContent = word && detail ? `${word}: ${detail}` : word ?? detail;
}

/** What a network says that has not learnt such a press. */
export function showFlags(id, words) {
  const text = words.join('; ');
  if (byId(id).dataset.said === text) return;
  byId(id).dataset.said = text;
  byId(id).replaceChildren(...words.map((word) => Object.assign(document.createElement('span'), { textContent: word })));
  byId(id).hidden = text === '';
}

let noticedAtMs = Infinity;

export function notify(message) {
  noticedAtMs = message === '' ? Infinity : performance.now();
  byId('notice').textContent = message;
  byId('notice').hidden = message === '';
}

/** Takes an old complaint away, now that frames are answered. */
export function forgetNotice() {
  if (performance.now() - noticedAtMs > NOTICE_MS) notify('');
}
