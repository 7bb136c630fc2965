//! The atlas: as it was shipped, as OBJ and glTF, and its mask.

use std::sync::Arc;

use axum::{
    extract::State,
    http::{HeaderMap, Uri},
};
use papilla_codec::encode_mask;
use papilla_proto::{
    ErrorCode, Problem,
    atlas::{Patch, Raster},
};

use crate::{
    core::{
        cache::Content,
        catalogue::{Catalogue, Document},
        fingers::Loaded,
    },
    problem,
    transport::{
        answer::{Answer, Shared, cached, refuse},
        app::App,
        http::finger::Asked,
    },
};

pub(crate) async fn json(State(app): Shared, Asked(finger): Asked, headers: HeaderMap) -> Answer {
    serve(&app, finger, &headers, Document::Atlas, |catalogue| {
        Ok(Content::new("application/json", catalogue.atlas_json.clone()))
    })
    .await
}

pub(crate) async fn obj(State(app): Shared, Asked(finger): Asked, headers: HeaderMap) -> Answer {
    serve(&app, finger, &headers, Document::AtlasObj, |catalogue| {
        Ok(Content::new("model/obj", catalogue.atlas.to_obj()))
    })
    .await
}

/// Both patches as binary glTF, each with its mask as a texture.
pub(crate) async fn glb(State(app): Shared, Asked(finger): Asked, headers: HeaderMap) -> Answer {
    serve(&app, finger, &headers, Document::AtlasGlb, |catalogue| {
        let masks = [png(&catalogue.skin)?, png(&catalogue.interface)?];
        Ok(Content::new("model/gltf-binary", catalogue.atlas.to_glb(&masks)))
    })
    .await
}

/// White where the patch is: the interface, or with `?patch=skin` the skin.
pub(crate) async fn mask(
    State(app): Shared,
    Asked(finger): Asked,
    uri: Uri,
    headers: HeaderMap,
) -> Answer {
    let patch = match patch(uri.query().unwrap_or_default()) {
        Ok(patch) => patch,
        Err(problem) => return refuse(&app, problem),
    };
    serve(&app, finger, &headers, Document::Mask(patch), move |catalogue| {
        let raster = match patch {
            Patch::Skin => &catalogue.skin,
            Patch::Interface => &catalogue.interface,
        };
        Ok(Content::new("image/png", png(raster)?))
    })
    .await
}

fn patch(query: &str) -> Result<Patch, Problem> {
    let mut patch = Patch::Interface;
    for (name, value) in form_urlencoded::parse(query.as_bytes()) {
        patch = match (&*name, &*value) {
            ("finger", _) => patch,
            ("patch", "interface") => Patch::Interface,
            ("patch", "skin") => Patch::Skin,
            _ => {
                let message = "the parameters are patch=interface or patch=skin, and finger";
                return Err(Problem::new(ErrorCode::BadQuery, message).at("patch"));
            }
        };
    }
    Ok(patch)
}

fn png(raster: &Raster) -> Result<Vec<u8>, Problem> {
    let mut png = Vec::new();
    encode_mask(raster.mask(), &mut png)
        .map_err(|error| problem::internal("the mask cannot be encoded", &error))?;
    Ok(png)
}

async fn serve(
    app: &Arc<App>,
    Loaded { catalogue, .. }: Loaded,
    headers: &HeaderMap,
    document: Document,
    make: impl FnOnce(&Catalogue) -> Result<Content, Problem> + Send + 'static,
) -> Answer {
    let of = Arc::clone(&catalogue);
    let made = cached(&catalogue.cache, headers, document, move || make(&of)).await;
    made.or_else(|problem| refuse(app, problem))
}
