// No guard: included for plain numbers by ray_walk.h, and once for each instruction set, for
// vectors of boxes and metaballs, by occlusion_packets-inl.h. With SHERD_HD for SHERD_FORMULA it
// compiles for the GPU. Needs bits.h and support_tree_view.h.
//
// Which boxes and supports of a SupportTree a beam may meet. Errs only towards too many.

// Lower corner a, upper corner b: the axis must pass the box, grown by the spread, between begin
// and end.
template <class T>
SHERD_FORMULA auto BeamMeetsBox(const Beam& beam, T ax, T ay, T az, T bx, T by, T bz) {
  const T x0 = (ax - T(beam.origin.x + beam.spread)) * T(beam.inverse.x);
  const T x1 = (bx - T(beam.origin.x - beam.spread)) * T(beam.inverse.x);
  const T y0 = (ay - T(beam.origin.y + beam.spread)) * T(beam.inverse.y);
  const T y1 = (by - T(beam.origin.y - beam.spread)) * T(beam.inverse.y);
  const T z0 = (az - T(beam.origin.z + beam.spread)) * T(beam.inverse.z);
  const T z1 = (bz - T(beam.origin.z - beam.spread)) * T(beam.inverse.z);
  const T enter = Max(Max(Min(x0, x1), Min(y0, y1)), Max(Min(z0, z1), T(beam.begin)));
  const T leave = Min(Min(Max(x0, x1), Max(y0, y1)), Min(Max(z0, z1), T(beam.end)));
  return enter <= leave;
}

// front, exit: bounds of the parameters at which any of the beam's rays is inside the support.
template <class T>
SHERD_FORMULA auto BeamMeetsSupport(const Beam& beam, T cx, T cy, T cz, T radius, T* front,
                                    T* exit) {
  const T x = cx - T(beam.origin.x), y = cy - T(beam.origin.y), z = cz - T(beam.origin.z);
  const T dx = T(beam.direction.x), dy = T(beam.direction.y), dz = T(beam.direction.z);
  const T along = x * dx + y * dy + z * dz;
  const T across_x = y * dz - z * dy, across_y = z * dx - x * dz, across_z = x * dy - y * dx;
  const T across2 = across_x * across_x + across_y * across_y + across_z * across_z;
  const T reach = radius + T(beam.spread);
  *front = along - reach;
  *exit = along + reach;
  return Both(across2 <= reach * reach, Both(*exit >= T(beam.begin), *front <= T(beam.end)));
}

// Calls visitor->Boxes(level, first) for the sixteens of boxes a beam may come to, which returns
// which of them it meets (bit 0: the first), and visitor->Metaballs(first) for the sixteens of
// metaballs in the leaves it meets.
template <class Visitor>
SHERD_FORMULA void WalkTree(const SupportTreeView& tree, Visitor* visitor) {
  constexpr std::uint32_t kWidth = SupportTreeView::kWidth;
  // The way down to where the walk is: on every level the first of a sixteen and those of it that
  // are still to be gone into.
  struct Sixteen {
    std::uint32_t first, rest;
  };
  Sixteen way[SupportTreeView::kMostLevels];
  const int top = tree.levels - 1;
  int k = top;
  way[k] = {0, visitor->Boxes(tree.level[k], 0)};
  for (;;) {
    Sixteen& at = way[k];
    if (k == 0) {
      for (; at.rest != 0; at.rest &= at.rest - 1) {
        visitor->Metaballs((at.first + static_cast<std::uint32_t>(LowestBit(at.rest))) * kWidth);
      }
    }
    if (at.rest == 0) {
      if (k == top) return;
      ++k;
      continue;
    }
    // From the last to the first: in the order in which they are found here, packets of rays sum
    // metaballs up.
    const int next = HighestBit(at.rest);
    at.rest ^= std::uint32_t{1} << next;
    const std::uint32_t first = (at.first + static_cast<std::uint32_t>(next)) * kWidth;
    --k;
    way[k] = {first, visitor->Boxes(tree.level[k], first)};
  }
}
