"""Statement in files with synthetic pictures of people that they are: XMP with IPTC's type of digital source.

Sources: XMP Specification Part 3, "Storage in Files" (Adobe 2020), for PNG and MP4; IPTC NewsCodes, "Digital Source
Type".
"""

from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from PIL.PngImagePlugin import PngInfo
from tts2face.picture.write_buffer import WriteBuffer

PNG_KEYWORD = "XML:com.adobe.xmp"  # of an iTXt chunk
MP4_BOX = bytes.fromhex("be7acfcb97a942e89c71999491e3afac")  # user type of a top-level "uuid" box
SOURCE_TYPE = "http://cv.iptc.org/newscodes/digitalsourcetype/compositeWithTrainedAlgorithmicMedia"
_PACKET = """<?xpacket begin="\N{ZERO WIDTH NO-BREAK SPACE}" id="W5M0MpCehiHzreSzNTczkc9d"?>
<x:xmpmeta xmlns:x="adobe:ns:meta/"><rdf:RDF xmlns:rdf="http://www.w3.org/1999/02/22-rdf-syntax-ns#"><rdf:Description
 rdf:about="" xmlns:Iptc4xmpExt="http://iptc.org/std/Iptc4xmpExt/2008-02-29/" xmlns:photoshop="http://ns.adobe.com/photoshop/1.0/"
 Iptc4xmpExt:DigitalSourceType={source} photoshop:Instructions={notice}/></rdf:RDF></x:xmpmeta>
<?xpacket end="r"?>"""


def xmp_packet(notice: str) -> str:
    """XMP packet of a file whose pictures are what `notice` says."""
    from xml.sax.saxutils import quoteattr  # it imports a web client

    return _PACKET.format(source=quoteattr(SOURCE_TYPE), notice=quoteattr(notice))


def png_labels(notice: str) -> "PngInfo":
    """Texts of a PNG file: the notice as its comment and in the packet; none for an empty one."""
    from PIL.PngImagePlugin import PngInfo

    labels = PngInfo()
    if notice:
        labels.add_text("Comment", notice)
        labels.add_itxt(PNG_KEYWORD, xmp_packet(notice))
    return labels


def append_to_mp4(target: Path | WriteBuffer, notice: str) -> None:
    """Append the packet to a complete MP4 file or stream, as its last box; nothing for an empty notice."""
    if not notice:
        return
    content = b"uuid" + MP4_BOX + xmp_packet(notice).encode()
    # of ISO 14496-12: its size, with these four bytes, stands first
    box = (4 + len(content)).to_bytes(4, "big") + content
    if isinstance(target, WriteBuffer):
        target.write(box)
        return
    with target.open("ab") as file:
        file.write(box)
