// The service whose page this is: what stands before /xr in the address, where a proxy gives it a path.

export const BASE = location.pathname.replace(/\/xr(\/[^/]*)?$/, '');
