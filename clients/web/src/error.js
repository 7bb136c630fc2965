// Refusals, by the server or by this client.

/** @typedef {import('./types.js').Problem} Problem */

/** A refusal by the server, or a fault of the session. */
export class PapillaError extends Error {
  /** @param {Problem} problem */
  constructor(problem) {
    super(`${problem.code}: ${problem.message}`);
    this.name = 'PapillaError';
    this.code = problem.code;
    this.problem = problem;
  }
}

/** @param {string} code as the server's @param {string} message */
export const refusal = (code, message) => new PapillaError({ type: 'error', code, message, closes: false });

/** @param {string} code @param {number} sequence @returns {Problem} */
export function missed(code, sequence) {
  const message = code === 'superseded' ? 'a newer frame took its place' : `the frame was ${code}`;
  return { type: 'error', code, message, sequence, closes: false };
}

/** @param {string} base @param {string} why */
export const unreachable = (base, why) => `no session at ${base || 'the server of the page'}: ${why}; is papilla-server running there, and does it take the token?`;
