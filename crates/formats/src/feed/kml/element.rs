//! Elements of KML by their names, whatever their prefix is: files have several namespaces, or none.

use crate::feed::sheet::Sheet;
use crate::place::Place;
use crate::zones::ZoneCode;
use roxmltree::Node;

/// The elements right below another.
pub(super) fn elements<'a, 'i>(parent: Node<'a, 'i>) -> impl Iterator<Item = Node<'a, 'i>> {
    parent.children().filter(Node::is_element)
}

/// Those of a name.
pub(super) fn named<'a, 'i, 'n>(
    parent: Node<'a, 'i>,
    name: &'n str,
) -> impl Iterator<Item = Node<'a, 'i>> + use<'a, 'i, 'n> {
    elements(parent).filter(move |element| element.tag_name().name() == name)
}

/// The only one of a name. Where there are several it is refused: readers differ in which one they
/// take.
pub(super) fn only<'a, 'i>(
    parent: Node<'a, 'i>,
    name: &str,
    place: &Place<'_>,
    sheet: &mut Sheet,
) -> Option<Node<'a, 'i>> {
    let mut found = named(parent, name);
    let first = found.next();
    if found.next().is_some() {
        let message = "the element is there more than once";
        let remedy = "leave one of them";
        sheet.refuse(ZoneCode::UnknownField, &place.member(name), message, remedy);
    }
    first
}

/// The text of an element, without the blanks around it.
pub(super) fn text_of(element: Node<'_, '_>) -> String {
    let pieces = element.children().filter(Node::is_text);
    let text: String = pieces.filter_map(|piece| piece.text()).collect();
    text.trim().to_owned()
}

/// The text of the only element of a name, unless it is absent or empty.
pub(super) fn text_under(
    parent: Node<'_, '_>,
    name: &str,
    place: &Place<'_>,
    sheet: &mut Sheet,
) -> Option<String> {
    let text = only(parent, name, place, sheet).map(text_of);
    text.filter(|text| !text.is_empty())
}
