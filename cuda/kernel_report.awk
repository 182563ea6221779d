# Rows of kernel_report.sh's table from `ptxas -v`, one line a kernel: architecture, row, spills.
function Less(a, b) { return a < b ? a : b }

BEGIN {
  # Limits of a multiprocessor (CUDA C++ Programming Guide, table of compute capabilities).
  memory["75"] = 64;   threads["75"] = 1024;  blocks["75"] = 16
  memory["80"] = 164;  threads["80"] = 2048;  blocks["80"] = 32
  memory["86"] = 100;  threads["86"] = 1536;  blocks["86"] = 16
  memory["89"] = 100;  threads["89"] = 1536;  blocks["89"] = 24
  memory["90"] = 228;  threads["90"] = 2048;  blocks["90"] = 32
  memory["120"] = 100; threads["120"] = 1536; blocks["120"] = 24
}

/Compiling entry function/ {
  name = ""
  # ForEachKernel<sherd::kernels::X<...> >, BlockKernel<sherd::kernels::P<...> > or
  # BoundedForEachKernel<sherd::kernels::ThesisRays<...<T, shape, own> > >
  if (match($0, /TraceTraits<\(sherd::ThresholdMode\)[0-9], [a-z]+, [a-z]+, [a-z]+, sherd::[A-Za-z]+/)) {
    name = substr($0, RSTART + 12, RLENGTH - 12)
    split(name, feature, /, /)
    name = "Trace, " (feature[1] ~ /1$/ ? "blended thresholds, " : "") \
           (feature[2] == "true" ? "a radius each" : "one radius") ", " \
           (feature[3] == "true" ? "colours" : "one colour") ", " feature[4] ", " \
           (feature[5] ~ /AnyShape/ ? "any density" : "Murakami\047s density")
    size = 64
  } else if (match($0, /GatherProgram<[a-z]+, sherd::kernels::[A-Za-z]+/)) {
    name = substr($0, RSTART + 14, RLENGTH - 14)
    split(name, feature, /, sherd::kernels::/)
    name = feature[2] ", " feature[1]
    size = 64
  } else if (match($0, /ThesisTraits<[a-z]+, sherd::[A-Za-z]+.*, (true|false)> > >\(/)) {
    name = substr($0, RSTART + 13, RLENGTH - 13)
    name = "ThesisRays, " (name ~ /^float/ ? "float" : "double") ", " \
           (name ~ /true> > >\($/ ? "radii or thresholds differ" : "all alike") ", " \
           (name ~ /AnyShape/ ? "any density" : "Murakami\047s density")
    size = 128
  } else if (match($0, /ForEachKernel<sherd::kernels::.*>\(/)) {
    name = substr($0, RSTART + 30, RLENGTH - 32)
    gsub(/sherd::kernels::|sherd::|\(|\)/, "", name)
    sub(/ +$/, "", name)
    size = /BoundedForEachKernel/ ? 128 : 256
    if (match(name, /ThresholdMode[0-9]/)) {
      mode = substr(name, RSTART + 13, 1)
      sub(/<.*/, ", " (mode == 0 ? "uniform" : mode == 1 ? "blended" : mode == 2 ? "summed" : "gated") \
          " thresholds, " (name ~ /float/ ? "float" : "double") ", " \
          (name ~ /FixedPower/ ? "Murakami\047s density" : "any density"), name)
    }
  }
}
/bytes stack frame/ { stack = $1; spills = $5 + $9 }
/Used [0-9]+ registers/ {
  if (name == "") next
  match($0, /Used [0-9]+/)
  registers = substr($0, RSTART + 5, RLENGTH - 5)
  shared = 0
  if (match($0, /[0-9]+ bytes smem/)) shared = substr($0, RSTART, RLENGTH - 11)
  # Registers are given to warps in steps of 256.
  of_warp = int((registers * 32 + 255) / 256) * 256
  by_registers = int(int(65536 / of_warp) / (size / 32))
  by_memory = shared ? int(memory[architecture] * 1024 / (shared + (architecture >= 80 ? 1024 : 0))) : 1000
  by_threads = int(threads[architecture] / size)
  by_blocks = blocks[architecture]
  resident = Less(Less(by_registers, by_memory), Less(by_threads, by_blocks))
  limit = resident == by_threads ? "threads" : resident == by_blocks ? "blocks" : \
          resident == by_memory ? "shared memory" : "registers"
  printf "%s\t| %s | %d | %d | %d | %d B | %d of %d | %s |\t%d\n", architecture, name, registers, spills, \
         stack, shared, resident * size / 32, threads[architecture] / 32, limit, spills
  name = ""
}
