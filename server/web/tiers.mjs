// Which tiers suit what a session gives: `poses`, of which the service finds the pressure, or
// `pressure`, maps of it. A network learnt the one, the other or both (docs/reference/protocol-hello.md).

/** What the name of a network ends with that learnt maps of pressure, where another has the name without it. */
const OF_MAPS = '-maps';

/** Whether the service itself would choose such a tier: what is no trained network takes any pressure. */
export const suits = (tier, given) => tier.kind !== 'network' || tier.learnt !== (given === 'poses' ? 'fe' : 'contact');

/** Those that suit; all where none does. */
export function suiting(tiers, given) {
  const found = tiers.filter((tier) => suits(tier, given));
  return found.length > 0 ? found : tiers;
}

/** The networks among which to choose for what is given: not what another outdoes, nor what is loaded when it is named, nor a closed form. */
export const choosable = (tiers, given) => suiting(tiers.filter((tier) => !tier.named_only && tier.kind !== 'closed_form'), given);

/** Median relative L2 error of SED against finite elements, from what is given. */
export const errorFrom = (tier, given) => (given === 'poses' ? tier.relative_l2_median_from_poses : null) ?? tier.relative_l2_median;

/** Name of the tier that the service takes for a hello that names none. */
export const defaultFor = (listing, given) => (given === 'poses' ? listing.default : listing.default_for_pressure);

/** The tier of this name, or its sibling where that learnt what is given and this one did not. */
export function tierFor({ tiers }, name, given) {
  const named = (wanted) => tiers.find((tier) => tier.name === wanted);
  const tier = named(name);
  if (!tier || suits(tier, given)) return name;
  const sibling = named(name.endsWith(OF_MAPS) ? name.slice(0, -OF_MAPS.length) : `${name}${OF_MAPS}`);
  return sibling && suits(sibling, given) ? sibling.name : name;
}

/** The tier to go on with where other things are given than before: a default by a default, else a sibling. */
export function tierAfter(listing, name, before, now) {
  if (before === now) return name;
  return name === defaultFor(listing, before) ? defaultFor(listing, now) : tierFor(listing, name, now);
}

/** The set of the ladder by which the service judges such tiers, among the `sets` that were measured. */
export function setFor({ judged_on: judgedOn, tiers }, sets, given) {
  const isJudged = tiers.some((tier) => tier.relative_l2_median_from_poses > 0);
  const wanted = given === 'poses' && isJudged ? 'poses' : judgedOn ?? 'heldout-presses';
  return sets.includes(wanted) ? wanted : sets[0];
}
