# Copyright 2026 the adhesion_node authors. SPDX-License-Identifier: Apache-2.0
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except in compliance with
# the License. You may obtain a copy of the License at http://www.apache.org/licenses/LICENSE-2.0 Unless required by
# applicable law or agreed to in writing, software distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific language
# governing permissions and limitations under the License.


"""What recorders compress by themselves, apart from their storage: files that are finished, or each message."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import ExitStack, suppress
from pathlib import Path
from tempfile import TemporaryDirectory

from zstandard import ZstdDecompressor, ZstdError

from ...command.written import naming
from .chunk import MAX_CHUNK_BYTES
from .mcap_file import TopicInfo
from .recordings import Record, Recording

PACKED = ".zstd"
"""How the names of files end, behind their kind."""

_MAGIC = b"\x28\xb5\x2f\xfd"
"""How a message that is compressed begins, and none that is not."""

_STRIDE = 2**14
"""What is decompressed at once, in bytes: so much of what is before a damage is lost."""


def unpacked(records: Iterable[Record]) -> Iterator[Record]:
    """Yield records, their messages decompressed; what does not decompress stays, and decodes as nothing."""
    for record in records:
        yield record._replace(cdr=_bare(record.cdr)) if record.cdr.startswith(_MAGIC) else record


def _bare(packed: bytes) -> bytes:
    with suppress(ZstdError), ZstdDecompressor(max_window_size=MAX_CHUNK_BYTES).stream_reader(packed) as stream:
        return stream.read(MAX_CHUNK_BYTES)
    return packed


class UnpackedRecording:
    """A recording, some files of which are decompressed for it, as far as they go, into a folder that it removes."""

    def __init__(self, files: Sequence[Path], open_files: Callable[[Sequence[Path]], Recording]) -> None:
        self.damage: list[str] = []
        with ExitStack() as stack:
            folder = Path(stack.enter_context(TemporaryDirectory(prefix="adhesion_node_")))
            try:
                with naming(f"{folder} (TMPDIR)"):
                    found = [self._unpacked(file, folder) if file.suffix == PACKED else file for file in files]
                if not (some := [file for file in found if file in files or file.stat().st_size]):
                    raise ValueError(f"bag = {files[0]}: nothing of it can be decompressed: name another recording")
                self._recording = open_files(some)
            except ValueError as error:
                raise ValueError(str(error).replace(str(folder), str(files[0].parent))) from error
            stack.callback(self._recording.close)
            self._stack = stack.pop_all()
        self.damage += [said.replace(str(folder), str(files[0].parent)) for said in self._recording.damage]

    def infos(self) -> Iterator[tuple[TopicInfo, int]]:
        """Yield the topics of every file."""
        return self._recording.infos()

    def records(self, wanted: Callable[[TopicInfo], bool]) -> Iterator[Record]:
        """Yield the records of all files merged."""
        return self._recording.records(wanted)

    def close(self) -> None:
        """Close the files and remove those that were made."""
        self._stack.close()

    def _unpacked(self, file: Path, folder: Path) -> Path:
        unpacked = folder / file.stem
        if not _unpack(file, unpacked):
            self.damage.append(f"{file} is cut off or damaged: what is before that is read")
        return unpacked


def _unpack(file: Path, unpacked: Path) -> bool:
    """Decompress a file; whether all of it was."""
    decoder = ZstdDecompressor().decompressobj()
    with file.open("rb") as source, unpacked.open("wb") as target:
        while piece := decoder.unused_data or source.read(_STRIDE):
            if decoder.eof:
                decoder = ZstdDecompressor().decompressobj()
            try:
                target.write(decoder.decompress(piece))
            except ZstdError:
                return False
    return decoder.eof
